// SPDX-License-Identifier: Apache-2.0
// A frame in one message, its answer in another. Thread safety as stated in the header.
#include "server/transport/step_call.h"

#include <string>
#include <utility>
#include <vector>

#include "proto/byte_buffer.h"
#include "server/transport/convert.h"
#include "server/transport/errors.h"
#include "server/transport/heavy.h"
#include "server/transport/reaction.h"
#include "server/transport/session_recording.h"
#include "server/transport/yield_to_steps.h"

namespace warmfront::server {
namespace {

/// What a response has besides its contacts is below this; the least message limit is 64 KiB.
constexpr std::size_t kRestBytes = 1024;

}  // namespace

StepCall* StepCall::start(Context& context, std::shared_ptr<Tenant> tenant,
                          std::function<Outcome<Request>()> receive, grpc::ByteBuffer& response) {
  yield_to_steps(context.runner.backlog());
  auto* call = new StepCall(context, response);
  const auto failed = [call](grpc::Status status) { finish_call(*call, std::move(status)); };
  react(
      [&] {
        if (tenant == nullptr) return call->step(receive());
        run_in_turn(context, std::move(tenant),
                    [call, failed, receive] { react([&] { call->step(receive()); }, failed); });
      },
      failed);
  return call;
}

void StepCall::step(const Outcome<Request>& request) {
  if (!request) return finish_call(*this, context_.refuse(request.fault()));
  Outcome<Lifecycle::Call> begun = context_.lifecycle.begin();
  if (!begun) return finish_call(*this, context_.refuse(begun.fault()));
  in_flight_.emplace(std::move(begun).value());
  step(*request.value().session, request.value().message);
}

void StepCall::step(Session& session, const v1::StepRequest& request) {
  FrameBuffer contents(session.dtype(), *session.scene());
  AdmittedFrame pass = admit_frame(session.tenant() != nullptr ? session.tenant()->frames : context_.frames,
                                   context_.frames, session.account(), contents.expected_bytes());
  if (pass.refused) return finish_call(*this, context_.refuse(*pass.refused, session.tenant()));
  Outcome<Question> question = question_from(request);
  if (!question) pass.refused = question.fault();
  pass.given_up = given_up_;
  response_bytes_ = Holding(session.account());
  pass.max_answer_bytes = context_.limits.max_message_bytes - kRestBytes;
  // An overflow is kept in the buffer, for the session to answer by its rules.
  append(request, contents);
  RecordedParts parts(session.account());
  if (session.companion()) {
    v1::StepFrame part;
    part.set_frame(request.frame());
    part.set_positions(request.positions());
    if (request.has_moved()) *part.mutable_moved() = request.moved();
    if (request.has_question()) *part.mutable_question() = request.question();
    parts.add(std::move(part), RecordedParts::kOneMessage);
  }
  auto [before, done] =
      recorded(recording_of(session), request.frame(), std::move(parts),
               [this, tenant = session.tenant()](const Outcome<std::shared_ptr<const Answer>>& outcome) {
                 answer(*this, [&] {
                   if (outcome) respond(*outcome.value());
                   return outcome ? grpc::Status::OK : context_.refuse(outcome.fault(), tenant);
                 });
               });
  session.step(request.frame(), std::move(contents), std::move(pass), Session::Admission::kBounded,
               std::move(done), std::move(before), question ? std::move(question).value() : refused_question(request));
}

void StepCall::respond(const Answer& answer) {
  v1::StepResponse response;
  response.set_frame(answer.frame);
  fill_columns(answer, 0, answer.rows(), *response.mutable_contacts());
  if (!answer.vertex_distances.empty())
    fill_distances(answer, 0, answer.vertex_distances.size(), *response.mutable_vertex_distances());
  if (!answer.worlds.empty())
    fill_worlds(answer, 0, answer.worlds.size(), *response.mutable_worlds(), *response.mutable_world_tois());
  *response.mutable_summary() = summary_of(answer);
  response_ = serialize(response);
  response_bytes_.set(response_.Length());
}

}  // namespace warmfront::server

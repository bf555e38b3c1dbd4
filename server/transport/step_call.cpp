// SPDX-License-Identifier: Apache-2.0
// A frame in one message, its answer in another. Thread safety as stated in the header.
#include "server/transport/step_call.h"

#include <string>
#include <utility>
#include <vector>

#include "server/transport/convert.h"
#include "server/transport/errors.h"
#include "server/transport/give_way.h"
#include "server/transport/session_recording.h"

namespace warmfront::server {

StepCall* StepCall::start(Context& context, const Outcome<std::shared_ptr<Session>>& session,
                          const v1::StepRequest& request, v1::StepResponse& response) {
  give_way(context.runner.backlog());
  auto* call = new StepCall(context, response);
  if (!session) {
    call->Finish(context.refuse(session.fault()));
  } else if (Outcome<Lifecycle::Call> begun = context.lifecycle.begin(); !begun) {
    call->Finish(context.refuse(begun.fault()));
  } else {
    call->in_flight_.emplace(std::move(begun).value());
    call->step(*session.value(), request);
  }
  return call;
}

void StepCall::step(Session& session, const v1::StepRequest& request) {
  FrameBuffer contents(session.dtype(), *session.scene());
  FramePass pass = admit_frame(context_.frames, session.account(), contents.expected_bytes());
  if (pass.refused) return Finish(context_.refuse(*pass.refused));
  pass.given_up = given_up_;
  // An overflow is kept in the buffer, for the session to answer by its rules.
  append(request, contents);
  std::vector<v1::StepFrame> parts;
  if (session.recording()) {
    v1::StepFrame& part = parts.emplace_back();
    part.set_frame(request.frame());
    part.set_positions(request.positions());
    if (request.has_moved()) *part.mutable_moved() = request.moved();
  }
  auto [before, done] =
      recorded(session.recording(), request.frame(), std::move(parts),
               [this](const Outcome<std::shared_ptr<const Answer>>& outcome) {
                 Finish(outcome ? respond(*outcome.value()) : context_.refuse(outcome.fault()));
               });
  session.step(request.frame(), std::move(contents), std::move(pass), Session::Admission::kBounded,
               std::move(done), std::move(before));
}

grpc::Status StepCall::respond(const Answer& answer) {
  const std::size_t bytes = answer.rows() * answer.bytes_per_row();
  // The rest of the message is below a kilobyte.
  if (bytes + 1024 > context_.limits.max_message_bytes)
    return context_.refuse(
        limit_met("frame " + std::to_string(answer.frame) + ": its answer of " + std::to_string(bytes) +
                      " bytes does not fit into one message; send the frame again over StreamSteps for it",
                  "max-message-bytes", false));
  response_.set_frame(answer.frame);
  fill_columns(answer, 0, answer.rows(), *response_.mutable_contacts());
  *response_.mutable_summary() = summary_of(answer);
  return grpc::Status::OK;
}

}  // namespace warmfront::server

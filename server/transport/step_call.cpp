// SPDX-License-Identifier: Apache-2.0
// A frame in one message, its answer in another. Thread safety as stated in the header.
#include "server/transport/step_call.h"

#include <string>
#include <utility>

#include "proto/byte_buffer.h"
#include "server/transport/convert.h"
#include "server/transport/errors.h"
#include "server/transport/frame_assembly.h"
#include "server/transport/frame_outcome.h"
#include "server/transport/heavy.h"
#include "server/transport/reaction.h"
#include "server/transport/yield_to_steps.h"

namespace warmfront::server {
namespace {

/// What a response has besides its contacts is below this; the least message limit is 64 KiB.
constexpr std::size_t kRestBytes = 1024;

}  // namespace

/// The call lives until it is answered.
class StepCall::Reply final : public FrameObserver {
 public:
  Reply(StepCall& call, Tenant* tenant, FrameRecord record, std::unique_ptr<FrameTrace> trace)
      : call_(call), tenant_(tenant), record_(std::move(record)), trace_(std::move(trace)) {}

  void begins() override {
    if (trace_) trace_->begun = FrameTrace::Clock::now();
    record_.begins();
  }
  void answered(const FrameOutcome& outcome) noexcept override {
    if (trace_) note_outcome(outcome, *trace_);
    record_.answered(outcome);
    answer(call_, [&] {
      if (outcome) call_.respond(*outcome.value());
      if (trace_) {
        // gRPC sends it after this call is left behind.
        trace_->encoded = trace_->sent = FrameTrace::Clock::now();
        call_.context_.tracer->finish(std::move(trace_));
      }
      return outcome ? grpc::Status::OK : call_.context_.refuse(outcome.fault(), tenant_);
    });
  }

 private:
  StepCall& call_;
  Tenant* const tenant_;  // may be null
  FrameRecord record_;
  std::unique_ptr<FrameTrace> trace_;  // null where it is not traced
};

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
  step(request.value());
}

void StepCall::step(const Request& whole) {
  Session& session = *whole.session;
  const v1::StepRequest& request = whole.message;
  FrameAssembly assembly(session, session.tenant() != nullptr ? session.tenant()->frames : context_.frames,
                         context_.frames, request.frame());
  FramePass& pass = assembly.pass();
  if (pass.refused) return finish_call(*this, context_.refuse(*pass.refused, session.tenant()));
  assembly.ask(request);
  pass.given_up = given_up_;
  response_bytes_ = Holding(session.account());
  pass.max_answer_bytes = context_.limits.max_message_bytes - kRestBytes;
  assembly.add(request);
  FrameRecord record(recording_of(session), request.frame(), assembly.take_parts());
  std::unique_ptr<FrameTrace> trace =
      context_.tracer
          ? context_.tracer->begin(whole.caller_trace, "Step", session.id().text(), request.frame())
          : nullptr;
  session.submit(
      assembly.finish(std::make_unique<Reply>(*this, session.tenant(), std::move(record), std::move(trace))),
      Session::Admission::kBounded);
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

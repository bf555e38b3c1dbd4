// SPDX-License-Identifier: Apache-2.0
// What a call writes: replies are queued as they come, and encoded and sent in their turn.
#include <grpc/grpc.h>

#include <utility>

#include "proto/byte_buffer.h"
#include "server/transport/convert.h"
#include "server/transport/errors.h"
#include "server/transport/step_stream.h"
#include "server/transport/yield_to_steps.h"
#include "server/units.h"

namespace warmfront::server {

void StepStream::attached(const Outcome<Standing>& standing) {
  guarded([&] {
    const MutexLock lock(mutex_);
    happened_locked(StreamEvent::Kind::kAttachSettled);
    if (standing) {
      v1::StreamStepsResponse response;
      v1::Attached& attached = *response.mutable_attached();
      const auto& [now, before] = standing.value();
      attached.set_expected_frame(now.frame + 1);
      *attached.mutable_limits() = to_proto(context_.limits, tenant_->quota());
      *attached.mutable_state() = to_proto(now);
      if (before) *attached.mutable_state_before() = to_proto(*before);
      // A call that has ended meanwhile would never take its token back.
      if (may_share_memory_ && takes_messages(state_)) token_ = context_.memory_desk->offer(weak_from_this());
      if (!token_.empty()) {
        attached.mutable_shared_memory()->set_token(token_);
        attached.mutable_shared_memory()->set_early_frames(true);
        attached.mutable_shared_memory()->set_moved(true);
      }
      queue_locked({serialize(response), false});
    } else {
      end_locked(context_.refuse(standing.fault(), tenant_.get()));
    }
    advance_locked();
  });
}

void StepStream::answered(std::uint64_t frame, const FrameOutcome& outcome, AnswerRoom room,
                          std::unique_ptr<FrameTrace> trace) {
  guarded([&] {
    const MutexLock lock(mutex_);
    if (!outcome) context_.count_refused(outcome.fault(), tenant_.get());
    if (outcome)
      queue_locked({AnswerChunks(outcome.value(), context_.limits.answer_chunk_bytes, std::move(room)), true,
                    std::move(trace)});
    else
      queue_locked({encode_error(frame, outcome.fault()), true, std::move(trace)});
    if (!outcome && outcome.fault().session_lost()) end_locked(to_grpc(outcome.fault()));
    advance_locked();
  });
}

void StepStream::notify_draining(std::chrono::system_clock::time_point deadline) {
  guarded([&] {
    v1::StreamStepsResponse response;
    response.mutable_draining()->set_deadline_unix_ms(
        std::chrono::duration_cast<std::chrono::milliseconds>(deadline.time_since_epoch()).count());
    const MutexLock lock(mutex_);
    queue_locked({serialize(response), false});
    advance_locked();
  });
}

void StepStream::queue_locked(Outgoing outgoing) {
  if (!takes_messages(state_)) return;
  const auto* answer = std::get_if<AnswerChunks>(&outgoing.what);
  const std::size_t bytes = answer ? answer->answer_bytes() : 0;
  writes_.push_back(std::move(outgoing));
  happened_locked(StreamEvent::Kind::kQueued, bytes);
}

void StepStream::write_locked() {
  Outgoing& next = writes_.front();
  if (auto* answer = std::get_if<AnswerChunks>(&next.what)) {
    try {
      if (!connection_) answer->forget_room();
      current_ = answer->next();
    } catch (const std::bad_alloc&) {
      end_locked(context_.refuse(
          limit_met("frame " + std::to_string(answer->frame()) +
                        ": no memory to send its answer; attach and send the frame again for it",
                    "memory", true)));
      return break_locked(StreamEvent::Kind::kBroken);
    }
    if (next.trace && next.trace->encoded == next.trace->received) next.trace->encoded = Clock::now();
    if (answer->done()) {
      happened_locked(StreamEvent::Kind::kFrameEndStarted, answer->answer_bytes());
      ending_trace_ = std::move(next.trace);
      writes_.pop_front();
    } else {
      happened_locked(StreamEvent::Kind::kPartStarted);
    }
  } else {
    current_ = std::move(std::get<grpc::ByteBuffer>(next.what));
    happened_locked(next.ends_frame ? StreamEvent::Kind::kFrameEndStarted
                                    : StreamEvent::Kind::kMessageStarted);
    ending_trace_ = std::move(next.trace);
    writes_.pop_front();
  }
  current_bytes_.set(current_.Length());
  write_began_ = Clock::now();
  send_locked();
}

void StepStream::OnWriteDone(bool ok) {
  yield_to_steps(context_.runner.backlog());
  guarded([&] {
    const MutexLock lock(mutex_);
    if (ok) {
      written_locked();
    } else {
      last_moved_ = Clock::now();
      current_.Clear();
      current_bytes_.set(0);
      break_locked(StreamEvent::Kind::kWriteLost);
    }
    advance_locked();
  });
}

// Finish() would wait behind the message that nobody takes: the call is cancelled with the status that it
// ends with.
void StepStream::cut_off_locked() {
  if (takes_messages(state_)) {
    grpc::Status status(grpc::StatusCode::UNAVAILABLE,
                        "StreamSteps: the client has not taken a message for " +
                            format_duration(context_.limits.write_stall_timeout) +
                            "; read answers as they come, or raise --write-stall-timeout");
    context_.metrics.refused_with("write-stall-timeout");
    end_ = std::move(status);
    break_locked(StreamEvent::Kind::kBroken);
  }
  const grpc::Status& status = end_ ? *end_ : grpc::Status::CANCELLED;
  grpc_call_cancel_with_status(rpc_.c_call(), static_cast<grpc_status_code>(status.error_code()),
                               status.error_message().c_str(), nullptr);
}

}  // namespace warmfront::server

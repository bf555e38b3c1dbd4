// SPDX-License-Identifier: Apache-2.0
// The course of a call: what is read, and how it ends. What the messages ask for: step_stream_requests.cpp;
// what is written: step_stream_writes.cpp. Thread safety as stated in the header.
#include "server/transport/step_stream.h"

#include <string>
#include <utility>

#include "proto/wire/codes.h"
#include "server/transport/call_tag.h"
#include "server/transport/heavy.h"
#include "server/transport/session_metadata.h"
#include "server/transport/yield_to_steps.h"
#include "server/units.h"

namespace warmfront::server {

StepStream::StepStream(Context& context, grpc::CallbackServerContext& call)
    : context_(context),
      rpc_(call),
      metadata_id_(session_metadata(call)),
      caller_trace_(TraceContext::parse(traceparent(call))),
      may_share_memory_(context.memory_desk != nullptr && call.peer().starts_with("unix:")) {}

StepStream* StepStream::start(Context& context, grpc::CallbackServerContext& call) {
  std::shared_ptr<StepStream> stream(new StepStream(context, call));
  stream->self_ = stream;
  stream->guarded([&] { stream->begin(); });
  return stream.get();
}

void StepStream::begin() {
  Outcome<Principal> principal = context_.identify(rpc_);
  if (!principal) {
    const MutexLock lock(mutex_);
    end_locked(context_.refuse(principal.fault()));
    return advance_locked();
  }
  principal_ = std::move(principal).value();
  tenant_ = context_.tenants.of(principal_.name);
  Outcome<Lifecycle::Call> begun = context_.lifecycle.begin(weak_from_this());
  const MutexLock lock(mutex_);
  ticket_ = tenant_->streams.enter(tenant_);
  if (!begun)
    end_locked(context_.refuse(begun.fault(), tenant_.get()));
  else
    call_.emplace(std::move(begun).value());
  if (!ticket_)
    end_locked(context_.refuse(gate_met(tenant_->streams, context_.streams, "StreamSteps: ", "streams open",
                                        "max-open-streams", "max-streams-per-principal"),
                               tenant_.get()));
  advance_locked();
}

void StepStream::fail(grpc::Status status, StreamEvent::Kind how) noexcept {
  context_.metrics.refused_with(status.error_code() == grpc::StatusCode::RESOURCE_EXHAUSTED ? "memory"
                                                                                            : "engine");
  const MutexLock lock(mutex_);
  // Whatever was to be delivered before a good end is not.
  if (!end_ || end_->ok()) end_ = std::move(status);
  break_locked(how);
  advance_locked();
}

void StepStream::OnReadDone(bool ok) {
  yield_to_steps(context_.runner.backlog());
  handling([&] {
    {
      const MutexLock lock(mutex_);
      last_moved_ = Clock::now();
      read_ = Read::kNone;
      if (state_.read != StreamRead::kReading || (ok && connection_ && !on_stream_)) {
        read_ = ok ? Read::kMessageWaits : Read::kEndWaits;
        return;
      }
      on_stream_ = false;
      happened_locked(StreamEvent::Kind::kReadDone);
    }
    if (!ok || !is_heavy<v1::StreamStepsRequest>(incoming_, Strings::kLeftInPlace)) return handle_read(ok);
    // Nothing is read, and the call is not finished, until it has been handled.
    run_in_turn(context_, tenant_,
                [self = shared_from_this()] { self->handling([&] { self->handle_read(true); }); });
  });
}

void StepStream::handle_read(bool ok) {
  if (ok) return handle_message(incoming_, Way::kStream);
  half_closed();
  const MutexLock lock(mutex_);
  happened_locked(StreamEvent::Kind::kHandled);
  advance_locked();
}

void StepStream::handle_message(grpc::ByteBuffer& message, Way way) {
  if (Outcome<StreamRequest> request = read_request(message, context_.parsing); request)
    handle(request.value(), way);
  else
    end(request.fault());
  message.Clear();
  const MutexLock lock(mutex_);
  happened_locked(StreamEvent::Kind::kHandled);
  advance_locked();
}

void StepStream::end(const Fault& fault) {
  guarded([&] {
    const MutexLock lock(mutex_);
    end_locked(context_.refuse(fault, tenant_.get()));
    advance_locked();
  });
}

void StepStream::end_if_quiet(const Fault& fault, std::chrono::milliseconds quiet) {
  guarded([&] {
    const MutexLock lock(mutex_);
    // With frames in hand, more may wait unread behind them.
    if (is_busy(state_) || Clock::now() - last_moved_ < quiet) return;
    end_locked(context_.refuse(fault));
    advance_locked();
  });
}

void StepStream::enforce_timeouts(std::chrono::steady_clock::time_point now) {
  guarded([&] {
    const MutexLock lock(mutex_);
    if (state_.course == StreamCourse::kFinished) return;
    const Limits& limits = context_.limits;
    if (state_.write != StreamWrite::kNone && now - write_began_ >= limits.write_stall_timeout) {
      cut_off_locked();
    } else if (awaits_client(state_) && now - awaited_since_ >= limits.upload_timeout) {
      end_locked(context_.refuse({ErrorCode::kDeadlineExceeded, Reason::kTimeout,
                                  std::string("StreamSteps: ") +
                                      (session_ ? "the rest of a frame" : "the message that attaches") +
                                      " did not come within " + format_duration(limits.upload_timeout) +
                                      "; send it faster, or raise --upload-timeout"}));
    } else {
      return;
    }
    advance_locked();
  });
}

void StepStream::enforce_rights() {
  if (context_.guard.still_knows(principal_)) return;
  guarded([&] { end(Guard::revoked()); });
}

void StepStream::give_up(const Fault& fault) {
  given_up_->store(true, std::memory_order_relaxed);
  end(fault);
}

void StepStream::end_locked(grpc::Status status) {
  if (!end_) end_ = std::move(status);
  happened_locked(StreamEvent::Kind::kEnded);
}

void StepStream::break_locked(StreamEvent::Kind kind) {
  happened_locked(kind);
  given_up_->store(true, std::memory_order_relaxed);
  writes_.clear();
  if (!std::exchange(waits_for_room_, false)) return;
  current_.Clear();
  current_bytes_.set(0);
  happened_locked(StreamEvent::Kind::kWriteLost);
}

void StepStream::log_end_locked(const grpc::Status& status) {
  const CallTag tag = call_tag(rpc_);
  // A client that heeds the notice of a drain ends its stream well: who drains wants to see every one end.
  // That a session was closed is logged where that is done.
  const bool closed = session_ && status.error_code() == grpc::StatusCode::NOT_FOUND;
  // Of a caller whom nobody knows there is a line, once a second.
  const bool routine = ((status.ok() || closed) && !context_.lifecycle.draining()) || !tenant_;
  // One that never attached, as while the daemon drains, is known by the session that its client named.
  std::string id;
  if (session_)
    id = session_->id().text();
  else if (const Outcome<SessionId> named = session_id_of({}, metadata_id_))
    id = named.value().text();
  context_.log.write(routine ? LogLevel::kDebug : LogLevel::kInfo, "stream_ended",
                     {{"session", id},
                      {"attached", session_ != nullptr},
                      {"principal", principal_.name},
                      {"code", std::int64_t{status.error_code()}},
                      {"code_name", wire::canonical_name(status.error_code())},
                      {"reason", status.error_message()},
                      {"request_id", tag.request_id},
                      {"traceparent", tag.traceparent}});
}

void StepStream::release_locked() {
  if (attachment_) session_->detach(*std::exchange(attachment_, std::nullopt));
}

void StepStream::finish_locked() {
  given_up_->store(true, std::memory_order_relaxed);
  // First, so that a client that has seen its stream end finds the session free for the next one.
  release_locked();
  if (!token_.empty()) context_.memory_desk->withdraw(std::exchange(token_, {}));
  unbind_locked();
  if (!end_) end_.emplace(grpc::StatusCode::CANCELLED, "");
  try {  // not if_memory_allows(): clang does not see the lock in what is handed on
    log_end_locked(*end_);
  } catch (const std::exception&) {  // a line of the log that there was no memory for
  }
  // Last: what is thrown before it leaves a call that can still be finished.
  happened_locked(StreamEvent::Kind::kFinishStarted);
  finish_call(*this, *std::move(end_));
}

void StepStream::happened_locked(StreamEvent::Kind kind, std::size_t bytes) {
  state_ = after(state_, {kind, bytes});
}

void StepStream::advance_locked() {
  const StreamBounds bounds{context_.limits.window, context_.limits.max_queued_bytes};
  for (;;) {
    switch (due(state_, bounds)) {
      case StreamAction::kNone:
        return;
      case StreamAction::kWrite:
        write_locked();
        break;
      case StreamAction::kRead:
        happened_locked(StreamEvent::Kind::kReadStarted);
        begin_read_locked();
        break;
      case StreamAction::kFinish:
        return finish_locked();
    }
  }
}

void StepStream::OnCancel() {
  guarded([&] {
    const MutexLock lock(mutex_);
    break_locked(StreamEvent::Kind::kBroken);
    advance_locked();
  });
}

void StepStream::OnDone() {
  yield_to_steps(context_.runner.backlog());
  std::shared_ptr<StepStream> self = std::move(self_);
  // The call counts as in flight until the stream is gone; the memory goes last.
  const std::optional<Lifecycle::Call> call = std::move(call_);
  const std::optional<Gate::Ticket> ticket = std::move(ticket_);
  self.reset();
}

}  // namespace warmfront::server

// SPDX-License-Identifier: Apache-2.0
// Receiving what a client streams. Thread safety as stated in the header.
#include "server/transport/upload_call.h"

#include <string>
#include <utility>

#include "server/transport/errors.h"
#include "server/transport/heavy.h"
#include "server/transport/reaction.h"
#include "server/units.h"
#include "warmfront/v1/session.pb.h"

namespace warmfront::server {

template <class Message>
UploadCall<Message>::UploadCall(const char* method, Context& context, const grpc::CallbackServerContext& call,
                                grpc::ByteBuffer& response)
    : method_(method), context_(context), call_(call), response_(response) {}

template <class Message>
void UploadCall<Message>::start(const std::shared_ptr<UploadCall>& call) {
  call->self_ = call;
  react(
      [&] {
        Context& context = call->context_;
        Outcome<Principal> principal = context.identify(call->call_);
        if (!principal) {
          const MutexLock lock(call->mutex_);
          return call->fail_locked(call->refused(principal.fault()));
        }
        call->principal_ = std::move(principal).value();
        call->tenant_ = context.tenants.of(call->principal_.name);
        Outcome<Lifecycle::Call> begun = context.lifecycle.begin(call);
        const MutexLock lock(call->mutex_);
        if (!begun) return call->fail_locked(call->refused(begun.fault()));
        call->in_flight_.emplace(std::move(begun).value());
        call->ticket_ = call->tenant_->uploads.enter(call->tenant_);
        if (!call->ticket_)
          return call->fail_locked(call->refused(
              gate_met(call->tenant_->uploads, call->tenant_->uploads, std::string(call->method_) + ": ",
                       "uploads under way", "max-uploads-per-principal", "max-uploads-per-principal")));
        call->StartRead(&call->incoming_);
      },
      [&](grpc::Status status) {
        const MutexLock lock(call->mutex_);
        call->fail_locked(std::move(status));
      });
}

template <class Message>
void UploadCall<Message>::OnDone() {
  done();
  std::shared_ptr<UploadCall> self = std::move(self_);
  // The call counts as in flight until it is gone; the memory goes last.
  const std::optional<Lifecycle::Call> in_flight = std::move(in_flight_);
  self.reset();
}

template <class Message>
template <class Work>
void UploadCall<Message>::guarded(Work work) noexcept {
  react(std::move(work), [&](grpc::Status status) {
    const MutexLock lock(mutex_);
    fail_locked(std::move(status));
  });
}

template <class Message>
void UploadCall<Message>::OnReadDone(bool ok) {
  guarded([&] {
    {
      const MutexLock lock(mutex_);
      last_moved_ = std::chrono::steady_clock::now();
      handling_ = true;
    }
    if (!ok) return upload_ended();
    if (!is_heavy<Message>(incoming_, Strings::kCopied)) return take(parse());
    run_in_turn(context_, tenant_,
                [call = this->shared_from_this()] { call->guarded([&] { call->take(call->parse()); }); });
  });
}

template <class Message>
Outcome<Parsed<Message>> UploadCall<Message>::parse() {
  grpc::ByteBuffer message;
  message.Swap(&incoming_);
  return parse_message<Message>(context_.parsing, std::move(message), method_);
}

template <class Message>
void UploadCall<Message>::take(Outcome<Parsed<Message>> parsed) {
  const MutexLock lock(mutex_);
  handling_ = false;
  last_moved_ = std::chrono::steady_clock::now();
  if (state_ != State::kUploading) return;  // it was ended meanwhile
  if (!parsed) return fail_locked(refused(parsed.fault()));
  if (std::optional<Fault> fault = add(std::move(parsed.value().message)))
    return fail_locked(refused(*fault));
  StartRead(&incoming_);
}

template <class Message>
void UploadCall<Message>::upload_ended() {
  const MutexLock lock(mutex_);
  if (state_ != State::kUploading) return;
  if (call_.IsCancelled()) return fail_locked(grpc::Status::CANCELLED);
  if (std::optional<Fault> fault = carry_out()) return fail_locked(refused(*fault));
  ticket_.reset();
}

template <class Message>
void UploadCall<Message>::OnCancel() {
  given_up_->store(true, std::memory_order_relaxed);
  const MutexLock lock(mutex_);
  fail_locked(grpc::Status::CANCELLED);
}

template <class Message>
void UploadCall<Message>::end(const Fault& fault) {
  const MutexLock lock(mutex_);
  if (state_ == State::kUploading) fail_locked(status_of(fault));
}

template <class Message>
void UploadCall<Message>::end_if_quiet(const Fault& fault, std::chrono::milliseconds quiet) {
  const MutexLock lock(mutex_);
  if (state_ == State::kUploading && !handling_ && std::chrono::steady_clock::now() - last_moved_ >= quiet)
    fail_locked(status_of(fault));
}

template <class Message>
void UploadCall<Message>::enforce_timeouts(std::chrono::steady_clock::time_point now) {
  const auto stalled = [&] {
    const MutexLock lock(mutex_);
    return !handling_ && now - last_moved_ >= context_.limits.write_stall_timeout;
  };
  const std::string method = method_;
  if (now - began_ >= context_.limits.upload_timeout)
    end({ErrorCode::kDeadlineExceeded, Reason::kTimeout,
         method + ": the upload did not end within " + format_duration(context_.limits.upload_timeout) +
             "; send it faster, or raise --upload-timeout"});
  else if (stalled())
    end({ErrorCode::kDeadlineExceeded, Reason::kTimeout,
         method + ": nothing of the upload came for " + format_duration(context_.limits.write_stall_timeout) +
             "; send it without a pause, or raise --write-stall-timeout"});
}

template <class Message>
void UploadCall<Message>::enforce_rights() {
  if (context_.guard.still_knows(principal_)) return;
  if_memory_allows([&] { end(Guard::revoked()); });
}

template <class Message>
void UploadCall<Message>::give_up(const Fault& fault) {
  if_memory_allows([&] {
    const MutexLock lock(mutex_);
    if (!given_up_by_daemon_) given_up_by_daemon_ = fault;
  });
  given_up_->store(true, std::memory_order_relaxed);
  end(fault);
}

template <class Message>
grpc::Status UploadCall<Message>::refused(const Fault& fault) const {
  if_memory_allows([&] { log_refused(fault); });
  return context_.refuse(fault, tenant_.get());
}

template <class Message>
grpc::Status UploadCall<Message>::status_of(const Fault& fault) const noexcept {
  try {
    return refused(fault);
  } catch (...) {
    return status_of_exception();
  }
}

template <class Message>
void UploadCall<Message>::fail_locked(grpc::Status status) {
  if (state_ != State::kUploading && state_ != State::kQueued) return;
  state_ = State::kFinished;
  ticket_.reset();
  give_back();
  finish_call(*this, std::move(status));
}

template class UploadCall<v1::CreateSessionRequest>;
template class UploadCall<v1::ChangeSceneRequest>;

}  // namespace warmfront::server

// SPDX-License-Identifier: Apache-2.0
// Uploading and building a session. Thread safety as stated in the header.
#include "server/transport/create_call.h"

#include <utility>

#include "proto/byte_buffer.h"
#include "server/session/step_cost.h"
#include "server/transport/call_tag.h"
#include "server/transport/convert.h"
#include "server/transport/delete_session.h"
#include "server/transport/errors.h"
#include "server/transport/heavy.h"
#include "server/transport/reaction.h"
#include "server/transport/stream_codec.h"
#include "server/units.h"

namespace warmfront::server {

CreateCall* CreateCall::start(Context& context, const grpc::CallbackServerContext& call,
                              grpc::ByteBuffer& response) {
  const std::shared_ptr<CreateCall> create(new CreateCall(context, call, response));
  create->self_ = create;
  react(
      [&] {
        Outcome<Principal> principal = context.guard.identify(call);
        if (!principal) {
          const MutexLock lock(create->mutex_);
          return create->fail_locked(create->refused(principal.fault()));
        }
        create->principal_ = std::move(principal).value();
        create->tenant_ = context.tenants.of(create->principal_.name);
        Outcome<Lifecycle::Call> begun = context.lifecycle.begin(create);
        const MutexLock lock(create->mutex_);
        if (!begun) return create->fail_locked(create->refused(begun.fault()));
        create->in_flight_.emplace(std::move(begun).value());
        create->ticket_ = create->tenant_->uploads.enter(create->tenant_);
        if (!create->ticket_)
          return create->fail_locked(create->refused(gate_met(
              create->tenant_->uploads, create->tenant_->uploads, "CreateSession: ", "uploads under way",
              "max-uploads-per-principal", "max-uploads-per-principal")));
        create->StartRead(&create->incoming_);
      },
      [&](grpc::Status status) {
        const MutexLock lock(create->mutex_);
        create->fail_locked(std::move(status));
      });
  return create.get();
}

CreateCall::CreateCall(Context& context, const grpc::CallbackServerContext& call, grpc::ByteBuffer& response)
    : context_(context), call_(call), response_(response), upload_(context.limits) {}

void CreateCall::OnDone() {
  if (made_) if_memory_allows([&] { drop_orphan(); });
  std::shared_ptr<CreateCall> self = std::move(self_);
  // The call counts as in flight until it is gone; the memory goes last.
  const std::optional<Lifecycle::Call> in_flight = std::move(in_flight_);
  self.reset();
}

template <class Work>
void CreateCall::guarded(Work work) noexcept {
  react(std::move(work), [&](grpc::Status status) {
    const MutexLock lock(mutex_);
    fail_locked(std::move(status));
  });
}

void CreateCall::OnReadDone(bool ok) {
  guarded([&] {
    {
      const MutexLock lock(mutex_);
      last_moved_ = std::chrono::steady_clock::now();
      handling_ = true;
    }
    if (!ok) return upload_ended();
    if (!is_heavy<v1::CreateSessionRequest>(incoming_, Strings::kCopied)) return take(parse());
    run_in_turn(context_, tenant_,
                [call = shared_from_this()] { call->guarded([&] { call->take(call->parse()); }); });
  });
}

Outcome<Parsed<v1::CreateSessionRequest>> CreateCall::parse() {
  grpc::ByteBuffer message;
  message.Swap(&incoming_);
  return parse_message<v1::CreateSessionRequest>(context_.parsing, std::move(message), "CreateSession");
}

void CreateCall::take(const Outcome<Parsed<v1::CreateSessionRequest>>& parsed) {
  const MutexLock lock(mutex_);
  handling_ = false;
  last_moved_ = std::chrono::steady_clock::now();
  if (state_ != State::kUploading) return;  // it was ended meanwhile
  if (!parsed) return fail_locked(refused(parsed.fault()));
  if (std::optional<Fault> fault = add(parsed.value().message)) return fail_locked(refused(*fault));
  StartRead(&incoming_);
}

void CreateCall::upload_ended() {
  const MutexLock lock(mutex_);
  if (state_ != State::kUploading) return;
  if (call_.IsCancelled()) return fail_locked(grpc::Status::CANCELLED);
  if (std::optional<Fault> fault = upload_->complete()) return fail_locked(refused(*fault));
  // Building takes some ten times as long as a step.
  const Lane lane = lane_of(10 * step_cost_ms(upload_->element_count(), {}));
  // The call may be over, and gone, before its turn comes.
  context_.runner.post([call = shared_from_this(), lane] { call->build(lane); }, lane,
                       std::shared_ptr<Share>(tenant_, &tenant_->share));
  state_ = State::kQueued;
  ticket_.reset();
}

void CreateCall::OnCancel() {
  given_up_ = true;
  const MutexLock lock(mutex_);
  fail_locked(grpc::Status::CANCELLED);
}

void CreateCall::end(const Fault& fault) {
  const MutexLock lock(mutex_);
  if (state_ == State::kUploading) fail_locked(status_of(fault));
}

void CreateCall::end_if_quiet(const Fault& fault, std::chrono::milliseconds quiet) {
  const MutexLock lock(mutex_);
  if (state_ == State::kUploading && !handling_ && std::chrono::steady_clock::now() - last_moved_ >= quiet)
    fail_locked(status_of(fault));
}

void CreateCall::enforce_timeouts(std::chrono::steady_clock::time_point now) {
  const auto stalled = [&] {
    const MutexLock lock(mutex_);
    return !handling_ && now - last_moved_ >= context_.limits.write_stall_timeout;
  };
  if (now - began_ >= context_.limits.upload_timeout)
    end({ErrorCode::kDeadlineExceeded, Reason::kTimeout,
         "CreateSession: the upload did not end within " + format_duration(context_.limits.upload_timeout) +
             "; send it faster, or raise --upload-timeout"});
  else if (stalled())
    end({ErrorCode::kDeadlineExceeded, Reason::kTimeout,
         "CreateSession: nothing of the upload came for " +
             format_duration(context_.limits.write_stall_timeout) +
             "; send it without a pause, or raise --write-stall-timeout"});
}

void CreateCall::enforce_rights() {
  if (context_.guard.still_knows(principal_)) return;
  if_memory_allows([&] { end(Guard::revoked()); });
}

void CreateCall::give_up(const Fault& fault) {
  if_memory_allows([&] {
    const MutexLock lock(mutex_);
    if (!given_up_by_daemon_) given_up_by_daemon_ = fault;
  });
  given_up_ = true;
  end(fault);
}

grpc::Status CreateCall::refused(const Fault& fault) const {
  if_memory_allows([&] { log_refused(fault); });
  return context_.refuse(fault, tenant_.get());
}

grpc::Status CreateCall::status_of(const Fault& fault) const noexcept {
  try {
    return refused(fault);
  } catch (...) {
    return status_of_exception();
  }
}

void CreateCall::fail_locked(grpc::Status status) {
  if (state_ != State::kUploading && state_ != State::kQueued) return;
  state_ = State::kFinished;
  give_back();
  finish_call(*this, std::move(status));
}

void CreateCall::give_back() {
  ticket_.reset();
  upload_.reset();
  account_.reset();
  reservation_.reset();
  recording_.reset();
}

std::optional<Fault> CreateCall::add(const v1::CreateSessionRequest& message) {
  if (std::optional<Fault> fault = upload_->add(message)) return fault;
  // Place and memory are taken before the bulk of the upload, so that a full daemon does not let it all come
  // in.
  if (!reservation_) {
    if (std::optional<Fault> fault = reserve()) return fault;
  }
  if (recording_) recording_->upload(message);
  return std::nullopt;
}

std::optional<Fault> CreateCall::reserve() {
  Outcome<Store::Reservation> place =
      context_.store.reserve(*upload_->id(), principal_.name, tenant_->max_sessions());
  if (!place) return place.fault();
  Outcome<std::shared_ptr<Account>> account =
      Account::open(context_.budget, context_.limits.max_session_bytes, upload_->estimate_bytes(),
                    std::shared_ptr<Budget>(tenant_, &tenant_->memory));
  if (!account) return account.fault();
  account_ = std::move(account).value();
  reservation_.emplace(std::move(place).value());
  if (context_.recordings) recording_ = context_.recordings->begin(*upload_->id(), account_);
  return std::nullopt;
}

void CreateCall::build(Lane lane) {
  {
    const MutexLock lock(mutex_);
    if (state_ != State::kQueued) return;  // its client has gone
    state_ = State::kBuilding;
  }
  react(
      [&] {
        Outcome<std::shared_ptr<Session>> made = make(lane);
        if (!made && made.fault().code == ErrorCode::kCancelled) {
          const MutexLock lock(mutex_);
          if (given_up_by_daemon_) made = *given_up_by_daemon_;
        }
        const grpc::Status status = made ? grpc::Status::OK : refused(made.fault());
        if (made && !call_.IsCancelled()) {
          made_ = std::move(made).value();
          // From here on nothing can fail.
          if (recording_) recording_->keep();
          reservation_->fill(made_);
          reservation_.reset();
          ++context_.metrics.sessions_created;
          if_memory_allows([&] { log_created(*made_); });
        } else {
          give_back();
        }
        finish_call(*this, status);
      },
      [&](grpc::Status status) {
        give_back();
        finish_call(*this, std::move(status));
      });
}

Outcome<std::shared_ptr<Session>> CreateCall::make(Lane lane) {
  const auto lost = [&context = context_](Session& session, const Fault& fault) {
    context.store.forget(session);
    ++context.metrics.sessions_ended[Metrics::kFailed];
    if_memory_allows([&] {
      context.log.write(LogLevel::kError, "session_failed",
                        {{"session", session.id().text()}, {"reason", fault.message}});
    });
  };
  const auto rebuilt = [&context = context_](const Session& session, const std::string& found) {
    if_memory_allows([&] {
      context.log.write(LogLevel::kWarning, "session_rebuilt",
                        {{"session", session.id().text()}, {"reason", found}});
    });
  };
  std::optional<Workers::OneThread> one_thread;
  if (context_.runner.takes_one_thread(lane)) one_thread.emplace();
  Outcome<std::shared_ptr<Session>> made =
      Session::create(upload_->take_spec(), upload_->take_positions(),
                      {context_.workers, context_.runner, context_.limits, std::move(account_), lost,
                       principal_.name, tenant_, &context_.metrics, recording_, rebuilt, &given_up_});
  if (made) {
    v1::CreateSessionResponse response;
    *response.mutable_session() = to_proto(*made.value());
    *response.mutable_limits() = to_proto(context_.limits, tenant_->quota());
    response_ = serialize(response);
  }
  return made;
}

void CreateCall::log_created(const Session& session) const {
  const CallTag tag = call_tag(call_);
  context_.log.write(LogLevel::kInfo, "session_created",
                     {{"session", session.id().text()},
                      {"principal", principal_.name},
                      {"vertices", std::uint64_t{session.scene()->vertex_count()}},
                      {"triangles", std::uint64_t{session.scene()->face_count()}},
                      {"bytes", std::uint64_t{session.snapshot().memory_bytes}},
                      {"first_frame", session.snapshot().state.frame},
                      {"request_id", tag.request_id},
                      {"traceparent", tag.traceparent}});
}

void CreateCall::log_refused(const Fault& fault) const {
  const CallTag tag = call_tag(call_);
  const SessionId* id = upload_ ? upload_->id() : nullptr;
  context_.log.write(LogLevel::kInfo, "create_refused",
                     {{"session", id != nullptr ? id->text() : std::string()},
                      {"principal", principal_.name},
                      {"code", std::int64_t{to_grpc_code(fault.code)}},
                      {"reason", fault.message},
                      {"request_id", tag.request_id},
                      {"traceparent", tag.traceparent}});
}

void CreateCall::drop_orphan() {
  if (call_.IsCancelled() && !made_->used())
    delete_session(context_, std::move(made_), "the call that creates it was cancelled");
}

}  // namespace warmfront::server

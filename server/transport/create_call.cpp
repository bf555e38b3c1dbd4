// SPDX-License-Identifier: Apache-2.0
// Uploading and building a session. Thread safety as stated in the header.
#include "server/transport/create_call.h"

#include <new>
#include <utility>

#include "server/session/step_cost.h"
#include "server/transport/call_tag.h"
#include "server/transport/convert.h"
#include "server/transport/errors.h"
#include "server/units.h"

namespace warmfront::server {

CreateCall* CreateCall::start(Context& context, const grpc::CallbackServerContext& call,
                              v1::CreateSessionResponse& response) {
  const std::shared_ptr<CreateCall> create(new CreateCall(context, call, response));
  create->self_ = create;
  Outcome<Principal> principal = context.guard.identify(call);
  if (!principal) {
    const MutexLock lock(create->mutex_);
    create->fail_locked(context.refuse(principal.fault()));
    return create.get();
  }
  Outcome<Lifecycle::Call> begun = context.lifecycle.begin(create);
  const MutexLock lock(create->mutex_);
  if (!begun) {
    create->fail_locked(context.refuse(begun.fault()));
  } else {
    create->in_flight_.emplace(std::move(begun).value());
    create->owner_ = std::move(principal).value().name;
    create->StartRead(&create->incoming_);
  }
  return create.get();
}

CreateCall::CreateCall(Context& context, const grpc::CallbackServerContext& call,
                       v1::CreateSessionResponse& response)
    : context_(context), call_(call), response_(response), upload_(context.limits) {}

void CreateCall::OnDone() {
  std::shared_ptr<CreateCall> self = std::move(self_);
  // The call counts as in flight until it is gone; the memory goes last.
  const std::optional<Lifecycle::Call> in_flight = std::move(in_flight_);
  self.reset();
}

void CreateCall::OnReadDone(bool ok) {
  const MutexLock lock(mutex_);
  if (state_ != State::kUploading) return;  // it was ended meanwhile
  last_moved_ = std::chrono::steady_clock::now();
  if (ok) {
    if (std::optional<Fault> fault = add()) return fail_locked(context_.refuse(*fault));
    return StartRead(&incoming_);
  }
  if (call_.IsCancelled()) return fail_locked(grpc::Status::CANCELLED);
  if (std::optional<Fault> fault = upload_->complete()) return fail_locked(context_.refuse(*fault));
  state_ = State::kBuilding;
  // Building takes some ten times as long as a step.
  const Lane lane = lane_of(10 * step_cost_ms(upload_->face_count(), {}));
  context_.runner.post([this, lane] { build(lane); }, lane);
}

void CreateCall::end(const Fault& fault) {
  const MutexLock lock(mutex_);
  if (state_ == State::kUploading) fail_locked(context_.refuse(fault));
}

void CreateCall::end_if_quiet(const Fault& fault, std::chrono::milliseconds quiet) {
  const MutexLock lock(mutex_);
  if (state_ == State::kUploading && std::chrono::steady_clock::now() - last_moved_ >= quiet)
    fail_locked(context_.refuse(fault));
}

void CreateCall::enforce_timeouts(std::chrono::steady_clock::time_point now) {
  if (now - began_ < context_.limits.upload_timeout) return;
  end({ErrorCode::kDeadlineExceeded, Reason::kTimeout,
       "CreateSession: the upload did not end within " + format_duration(context_.limits.upload_timeout) +
           "; send it faster, or raise --upload-timeout"});
}

void CreateCall::fail_locked(const grpc::Status& status) {
  if (state_ != State::kUploading) return;
  state_ = State::kFinished;
  upload_.reset();
  account_.reset();
  reservation_.reset();
  recording_.reset();
  Finish(status);
}

std::optional<Fault> CreateCall::add() {
  try {
    if (std::optional<Fault> fault = upload_->add(incoming_)) return fault;
  } catch (const std::bad_alloc&) {
    return limit_met("CreateSession: the daemon has no memory for this upload; use a smaller scene",
                     "max-total-bytes", true);
  }
  // Place and memory are taken before the bulk of the upload, so that a full daemon does not let it all come
  // in.
  if (!reservation_) {
    if (std::optional<Fault> fault = reserve()) return fault;
  }
  if (recording_) recording_->upload(incoming_);
  return std::nullopt;
}

std::optional<Fault> CreateCall::reserve() {
  Outcome<Store::Reservation> place = context_.store.reserve(*upload_->id(), owner_);
  if (!place) return place.fault();
  Outcome<std::shared_ptr<Account>> account =
      Account::open(context_.budget, context_.limits.max_session_bytes, upload_->estimate_bytes(),
                    context_.principals.of(owner_));
  if (!account) return account.fault();
  account_ = std::move(account).value();
  reservation_.emplace(std::move(place).value());
  if (context_.recordings) recording_ = Recordings::begin(context_.recordings, *upload_->id());
  return std::nullopt;
}

void CreateCall::build(Lane lane) {
  const auto lost = [&context = context_](Session& session, const Fault& fault) {
    context.store.forget(session);
    ++context.metrics.sessions_ended[Metrics::kFailed];
    context.log.write(LogLevel::kError, "session_failed",
                      {{"session", session.id().text()}, {"reason", fault.message}});
  };
  const auto rebuilt = [&context = context_](const Session& session, const std::string& found) {
    context.log.write(LogLevel::kWarning, "session_rebuilt",
                      {{"session", session.id().text()}, {"reason", found}});
  };
  std::optional<Workers::OneThread> one_thread;
  if (context_.runner.takes_one_thread(lane)) one_thread.emplace();
  Outcome<std::shared_ptr<Session>> built =
      Session::create(upload_->take_spec(), upload_->take_positions(),
                      {context_.workers, context_.runner, context_.limits, std::move(account_), lost, owner_,
                       &context_.metrics, recording_, rebuilt});
  one_thread.reset();
  if (!built) {
    reservation_.reset();
    recording_.reset();
    return Finish(context_.refuse(built.fault()));
  }
  const std::shared_ptr<Session>& session = built.value();
  if (recording_) recording_->keep();
  reservation_->fill(session);
  *response_.mutable_session() = to_proto(*session);
  *response_.mutable_limits() = to_proto(context_.limits);
  ++context_.metrics.sessions_created;
  const CallTag tag = call_tag(call_);
  context_.log.write(LogLevel::kInfo, "session_created",
                     {{"session", session->id().text()},
                      {"principal", owner_},
                      {"vertices", std::uint64_t{session->scene()->vertex_count()}},
                      {"triangles", std::uint64_t{session->scene()->face_count()}},
                      {"bytes", std::uint64_t{session->snapshot().memory_bytes}},
                      {"first_frame", session->snapshot().state.frame},
                      {"request_id", tag.request_id},
                      {"traceparent", tag.traceparent}});
  Finish(grpc::Status::OK);
}

}  // namespace warmfront::server

// SPDX-License-Identifier: Apache-2.0
// Uploading and building a session. Thread safety as stated in the header.
#include "server/transport/create_call.h"

#include <utility>

#include "proto/byte_buffer.h"
#include "proto/wire/codes.h"
#include "server/session/step_cost.h"
#include "server/transport/call_tag.h"
#include "server/transport/convert.h"
#include "server/transport/delete_session.h"
#include "server/transport/errors.h"
#include "server/transport/reaction.h"

namespace warmfront::server {

CreateCall* CreateCall::start(Context& context, const grpc::CallbackServerContext& call,
                              grpc::ByteBuffer& response) {
  const std::shared_ptr<CreateCall> create(new CreateCall(context, call, response));
  UploadCall::start(create);
  return create.get();
}

CreateCall::CreateCall(Context& context, const grpc::CallbackServerContext& call, grpc::ByteBuffer& response)
    : UploadCall("CreateSession", context, call, response), upload_(context.limits) {}

void CreateCall::done() {
  if (made_) if_memory_allows([&] { drop_orphan(); });
}

std::optional<Fault> CreateCall::carry_out() {
  if (std::optional<Fault> fault = upload_->complete()) return fault;
  // Building takes some ten times as long as a step.
  const Lane lane = lane_of(10 * step_cost_ms(upload_->element_count(), {}));
  // The call may be over, and gone, before its turn comes.
  context_.runner.post([call = self<CreateCall>(), lane] { call->build(lane); }, lane,
                       std::shared_ptr<Share>(tenant_, &tenant_->share));
  state_ = State::kQueued;
  return std::nullopt;
}

void CreateCall::give_back() {
  upload_.reset();
  account_.reset();
  reservation_.reset();
  recording_.reset();
}

std::optional<Fault> CreateCall::add(v1::CreateSessionRequest message) {
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
    state_ = State::kBegun;
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
                       principal_.name, tenant_, &context_.metrics, recording_, rebuilt, given_up_.get()});
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
  if (!tenant_) return;  // nobody known: another line says so
  const char* const code_name = wire::canonical_name(wire::canonical_code(fault.code));
  // Whoever tries again and again fills no disk.
  const auto left_out = context_.refused_creates.admit(principal_.name + " " + code_name + " " + fault.limit);
  if (!left_out) return;
  const CallTag tag = call_tag(call_);
  const SessionId* id = upload_ ? upload_->id() : nullptr;
  context_.log.write(LogLevel::kInfo, "create_refused",
                     {{"session", id != nullptr ? id->text() : std::string()},
                      {"principal", principal_.name},
                      {"code", std::int64_t{to_grpc_code(fault.code)}},
                      {"code_name", code_name},
                      {"reason", fault.message},
                      {"request_id", tag.request_id},
                      {"traceparent", tag.traceparent},
                      {"left_out", *left_out}});
}

void CreateCall::drop_orphan() {
  if (call_.IsCancelled() && !made_->used())
    delete_session(context_, std::move(made_), "the call that creates it was cancelled");
}

}  // namespace warmfront::server

// SPDX-License-Identifier: Apache-2.0
// Uploading and building a session. Thread safety as stated in the header.
#include "server/transport/create_call.h"

#include <new>
#include <utility>

#include "server/transport/convert.h"
#include "server/transport/errors.h"

namespace warmfront::server {

CreateCall* CreateCall::start(Context& context, const grpc::CallbackServerContext& call,
                              v1::CreateSessionResponse& response) {
  auto* create = new CreateCall(context, call, response);
  Outcome<Lifecycle::Call> begun = context.lifecycle.begin();
  if (begun) {
    create->in_flight_.emplace(std::move(begun).value());
    create->StartRead(&create->incoming_);
  } else {
    create->Finish(to_grpc(begun.fault()));
  }
  return create;
}

CreateCall::CreateCall(Context& context, const grpc::CallbackServerContext& call,
                       v1::CreateSessionResponse& response)
    : context_(context), call_(call), response_(response), upload_(context.limits) {}

void CreateCall::OnReadDone(bool ok) {
  if (ok) {
    if (std::optional<Fault> fault = add()) return fail(to_grpc(*fault));
    return StartRead(&incoming_);
  }
  if (call_.IsCancelled()) return fail(grpc::Status::CANCELLED);
  if (std::optional<Fault> fault = upload_.complete()) return fail(to_grpc(*fault));
  context_.runner.post([this] { build(); });
}

void CreateCall::fail(const grpc::Status& status) {
  reservation_.reset();
  Finish(status);
}

std::optional<Fault> CreateCall::add() {
  try {
    if (std::optional<Fault> fault = upload_.add(incoming_)) return fault;
  } catch (const std::bad_alloc&) {
    return Fault{ErrorCode::kResourceExhausted, Reason::kLimit,
                 "CreateSession: the daemon has no memory for this upload; use a smaller scene"};
  }
  if (!reservation_) {
    // The place is taken before the bulk of the upload, so that a full daemon does not let it all come in.
    Outcome<Store::Reservation> reservation = context_.store.reserve(*upload_.id());
    if (!reservation) return reservation.fault();
    reservation_.emplace(std::move(reservation).value());
  }
  return std::nullopt;
}

void CreateCall::build() {
  const auto lost = [&context = context_](Session& session, const Fault& fault) {
    context.store.forget(session);
    context.log.write(LogLevel::kError, "session_failed",
                      {{"session", session.id().text()}, {"reason", fault.message}});
  };
  Outcome<std::shared_ptr<Session>> built =
      Session::create(upload_.take_spec(), upload_.take_positions(), context_.workers, context_.runner,
                      context_.limits.window, lost);
  if (!built) return fail(to_grpc(built.fault()));
  const std::shared_ptr<Session>& session = built.value();
  reservation_->fill(session);
  *response_.mutable_session() = to_proto(*session);
  *response_.mutable_limits() = to_proto(context_.limits);
  context_.log.write(LogLevel::kInfo, "session_created",
                     {{"session", session->id().text()},
                      {"vertices", std::uint64_t{session->scene().vertex_count()}},
                      {"triangles", std::uint64_t{session->scene().face_count()}},
                      {"bytes", std::uint64_t{session->snapshot().memory_bytes}},
                      {"first_frame", session->snapshot().last_frame}});
  Finish(grpc::Status::OK);
}

}  // namespace warmfront::server

// SPDX-License-Identifier: Apache-2.0
// The administrators' calls. Thread-safe.
#include "server/transport/admin_service.h"

#include <grpcpp/grpcpp.h>

#include <utility>

#include "server/transport/convert.h"
#include "server/transport/delete_session.h"
#include "server/transport/errors.h"
#include "server/transport/raw_unary.h"
#include "warmfront/v1/admin_service.grpc.pb.h"

namespace warmfront::server {
namespace {

using Base = v1::AdminService::WithRawCallbackMethod_ListAllSessions<
    v1::AdminService::WithRawCallbackMethod_DeleteAnySession<v1::AdminService::Service>>;

class AdminService final : public Base {
 public:
  explicit AdminService(Context& context) : context_(context) {}

  grpc::ServerUnaryReactor* ListAllSessions(grpc::CallbackServerContext* call,
                                            const grpc::ByteBuffer* request,
                                            grpc::ByteBuffer* response) override {
    return respond<v1::ListAllSessionsRequest, v1::ListAllSessionsResponse>(
        *call, *request, *response, "ListAllSessions", [&](const auto&, auto& reply) {
          for (const std::shared_ptr<Session>& session : context_.store.list()) {
            v1::OwnedSession& owned = *reply.add_sessions();
            *owned.mutable_session() = to_proto(*session);
            owned.set_principal(session->owner());
          }
          return grpc::Status::OK;
        });
  }

  grpc::ServerUnaryReactor* DeleteAnySession(grpc::CallbackServerContext* call,
                                             const grpc::ByteBuffer* request,
                                             grpc::ByteBuffer* response) override {
    return respond<v1::DeleteAnySessionRequest, v1::DeleteAnySessionResponse>(
        *call, *request, *response, "DeleteAnySession", [&](const auto& received, auto&) {
          const Outcome<SessionId> id = SessionId::parse(received.message.session_id());
          if (!id) return context_.refuse(id.fault());
          Outcome<std::shared_ptr<Session>> session =
              received.message.has_principal() ? context_.store.find(id.value(), received.message.principal())
                                               : context_.store.find_any(id.value());
          if (!session) return context_.refuse(session.fault());
          delete_session(context_, std::move(session).value(), "deleted by an administrator");
          return grpc::Status::OK;
        });
  }

 private:
  /// `fill` is done for administrators only, and nothing is parsed for others.
  template <class Request, class Response, class Fill>
  grpc::ServerUnaryReactor* respond(grpc::CallbackServerContext& call, const grpc::ByteBuffer& request,
                                    grpc::ByteBuffer& response, const char* method, Fill fill) const {
    return raw_unary<Request, Response>(
        context_, call, response,
        [&] { return receive_from<Request>(context_.guard.identify_admin(call), context_, request, method); },
        fill);
  }

  Context& context_;
};

}  // namespace

std::unique_ptr<grpc::Service> make_admin_service(Context& context) {
  return std::make_unique<AdminService>(context);
}

}  // namespace warmfront::server

// SPDX-License-Identifier: Apache-2.0
// The administrators' calls. Thread-safe.
#include "server/transport/admin_service.h"

#include <grpcpp/grpcpp.h>

#include <string>
#include <utility>

#include "server/transport/call_tag.h"
#include "server/transport/convert.h"
#include "server/transport/delete_session.h"
#include "server/transport/errors.h"
#include "server/transport/pages.h"
#include "server/transport/raw_unary.h"
#include "server/transport/session_metadata.h"
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
        *call, *request, *response, "ListAllSessions", [&](const auto& received, auto& reply, AuditEvent&) {
          Outcome<std::string> next =
              add_page(context_.store.list(), received.message, [&](const Session& session) {
                v1::OwnedSession& owned = *reply.add_sessions();
                *owned.mutable_session() = to_proto(session);
                owned.set_principal(session.owner());
              });
          if (!next) return context_.refuse(next.fault());
          reply.set_next_page_token(std::move(next).value());
          return grpc::Status::OK;
        });
  }

  grpc::ServerUnaryReactor* DeleteAnySession(grpc::CallbackServerContext* call,
                                             const grpc::ByteBuffer* request,
                                             grpc::ByteBuffer* response) override {
    return respond<v1::DeleteAnySessionRequest, v1::DeleteAnySessionResponse>(
        *call, *request, *response, "DeleteAnySession", [&](const auto& received, auto&, AuditEvent& event) {
          event.session = received.message.session_id();
          event.owner = received.message.principal();
          const Outcome<SessionId> id = SessionId::parse(received.message.session_id());
          if (!id) return context_.refuse(id.fault());
          Outcome<std::shared_ptr<Session>> session =
              received.message.has_principal() ? context_.store.find(id.value(), received.message.principal())
                                               : context_.store.find_any(id.value());
          if (!session) return context_.refuse(session.fault());
          event.owner = session.value()->owner();
          delete_session(context_, std::move(session).value(), "deleted by an administrator");
          return grpc::Status::OK;
        });
  }

 private:
  /// `fill` is done for administrators only, and nothing is parsed for others; it may say in the event what
  /// it was about. Whatever comes of it is recorded.
  template <class Request, class Response, class Fill>
  grpc::ServerUnaryReactor* respond(grpc::CallbackServerContext& call, const grpc::ByteBuffer& request,
                                    grpc::ByteBuffer& response, const char* method, Fill fill) const {
    context_.metrics.call_began(method);
    AuditEvent event{
        .action = method, .principal = {}, .peer = call.peer(), .request_id = call_tag(call).request_id};
    // Known before anything is parsed: whose call is refused may name it here.
    if (const Outcome<SessionId> named = SessionId::parse(session_metadata(call)))
      event.session = named.value().text();
    const auto record = [&](int code, std::string reason) {
      event.code = code;
      event.reason = std::move(reason);
      context_.audit->record(event);
    };
    return raw_unary<Request, Response>(
        context_, call, response,
        [&] {
          if (const Outcome<Principal> caller = context_.identify(call))
            event.principal = caller.value().name;
          Outcome<Received<Request>> received =
              receive_from<Request>(context_.guard.identify_admin(call), context_, request, method);
          if (!received) record(to_grpc_code(received.fault().code), received.fault().message);
          return received;
        },
        [&](const Received<Request>& received, Response& reply) {
          const grpc::Status status = fill(received, reply, event);
          record(status.error_code(), status.error_message());
          return status;
        });
  }

  Context& context_;
};

}  // namespace

std::unique_ptr<grpc::Service> make_admin_service(Context& context) {
  return std::make_unique<AdminService>(context);
}

}  // namespace warmfront::server

// SPDX-License-Identifier: Apache-2.0
// The administrators' calls. Thread-safe.
#include "server/transport/admin_service.h"

#include <grpcpp/grpcpp.h>

#include <utility>

#include "server/transport/convert.h"
#include "server/transport/delete_session.h"
#include "server/transport/errors.h"
#include "server/transport/reaction.h"
#include "warmfront/v1/admin_service.grpc.pb.h"

namespace warmfront::server {
namespace {

class AdminService final : public v1::AdminService::CallbackService {
 public:
  explicit AdminService(Context& context) : context_(context) {}

  grpc::ServerUnaryReactor* ListAllSessions(grpc::CallbackServerContext* call,
                                            const v1::ListAllSessionsRequest*,
                                            v1::ListAllSessionsResponse* response) override {
    return finish(call, [&]() -> std::optional<Fault> {
      for (const std::shared_ptr<Session>& session : context_.store.list()) {
        v1::OwnedSession& owned = *response->add_sessions();
        *owned.mutable_session() = to_proto(*session);
        owned.set_principal(session->owner());
      }
      return std::nullopt;
    });
  }

  grpc::ServerUnaryReactor* DeleteAnySession(grpc::CallbackServerContext* call,
                                             const v1::DeleteAnySessionRequest* request,
                                             v1::DeleteAnySessionResponse*) override {
    return finish(call, [&]() -> std::optional<Fault> {
      const Outcome<SessionId> id = SessionId::parse(request->session_id());
      if (!id) return id.fault();
      Outcome<std::shared_ptr<Session>> session = request->has_principal()
                                                      ? context_.store.find(id.value(), request->principal())
                                                      : context_.store.find_any(id.value());
      if (!session) return session.fault();
      delete_session(context_, std::move(session).value(), "deleted by an administrator");
      return std::nullopt;
    });
  }

 private:
  /// `work` is done for administrators only.
  template <class Work>
  grpc::ServerUnaryReactor* finish(grpc::CallbackServerContext* call, Work work) const {
    grpc::ServerUnaryReactor* reactor = call->DefaultReactor();
    answer(*reactor, [&] {
      const Outcome<Principal> admin = context_.guard.identify_admin(*call);
      const std::optional<Fault> fault = admin ? work() : admin.fault();
      return fault ? context_.refuse(*fault) : grpc::Status::OK;
    });
    return reactor;
  }

  Context& context_;
};

}  // namespace

std::unique_ptr<grpc::Service> make_admin_service(Context& context) {
  return std::make_unique<AdminService>(context);
}

}  // namespace warmfront::server

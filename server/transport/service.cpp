// SPDX-License-Identifier: Apache-2.0
// The service's methods: the small ones here, the streaming ones in files of their own. Thread-safe.
#include "server/transport/service.h"

#include <grpcpp/grpcpp.h>

#include <utility>

#include "server/transport/convert.h"
#include "server/transport/create_call.h"
#include "server/transport/delete_session.h"
#include "server/transport/errors.h"
#include "server/transport/reaction.h"
#include "server/transport/session_metadata.h"
#include "server/transport/session_recording.h"
#include "server/transport/step_call.h"
#include "server/transport/step_stream.h"
#include "server/transport/stream_codec.h"
#include "server/version.h"
#include "warmfront/v1/collision_service.grpc.pb.h"

namespace warmfront::server {
namespace {

/// Those whose messages may be large take them raw, and parse them where nothing is thrown out of: gRPC
/// parses typed ones on its own threads, which memory that ends there takes the process down with.
using Base = v1::CollisionService::WithRawCallbackMethod_CreateSession<
    v1::CollisionService::WithCallbackMethod_GetSession<v1::CollisionService::WithCallbackMethod_ListSessions<
        v1::CollisionService::WithCallbackMethod_DeleteSession<
            v1::CollisionService::WithCallbackMethod_ChangeScene<
                v1::CollisionService::WithCallbackMethod_CheckSession<
                    v1::CollisionService::WithRawCallbackMethod_Step<
                        v1::CollisionService::WithCallbackMethod_GetServerInfo<
                            v1::CollisionService::WithRawCallbackMethod_StreamSteps<
                                v1::CollisionService::Service>>>>>>>>>;

grpc::ServerUnaryReactor* finish(grpc::CallbackServerContext* call, grpc::Status status) {
  grpc::ServerUnaryReactor* reactor = call->DefaultReactor();
  finish_call(*reactor, std::move(status));
  return reactor;
}

class CollisionService final : public Base {
 public:
  explicit CollisionService(Context& context) : context_(context) {}

  grpc::ServerReadReactor<grpc::ByteBuffer>* CreateSession(grpc::CallbackServerContext* call,
                                                           grpc::ByteBuffer* response) override {
    return streaming<grpc::ServerReadReactor<grpc::ByteBuffer>>(
        [&] { return CreateCall::start(context_, *call, *response); });
  }

  grpc::ServerUnaryReactor* GetSession(grpc::CallbackServerContext* call,
                                       const v1::GetSessionRequest* request,
                                       v1::GetSessionResponse* response) override {
    return unary(*call, [&]() -> grpc::ServerUnaryReactor* {
      Outcome<std::shared_ptr<Session>> session = find(*call, request->session_id());
      if (!session) return finish(call, context_.refuse(session.fault()));
      *response->mutable_session() = to_proto(*session.value());
      session.value()->touch();
      return finish(call, grpc::Status::OK);
    });
  }

  grpc::ServerUnaryReactor* ListSessions(grpc::CallbackServerContext* call, const v1::ListSessionsRequest*,
                                         v1::ListSessionsResponse* response) override {
    return unary(*call, [&]() -> grpc::ServerUnaryReactor* {
      const Outcome<Principal> principal = context_.guard.identify(*call);
      if (!principal) return finish(call, context_.refuse(principal.fault()));
      for (const std::shared_ptr<Session>& session : context_.store.list())
        if (session->owner() == principal.value().name) *response->add_sessions() = to_proto(*session);
      return finish(call, grpc::Status::OK);
    });
  }

  grpc::ServerUnaryReactor* DeleteSession(grpc::CallbackServerContext* call,
                                          const v1::DeleteSessionRequest* request,
                                          v1::DeleteSessionResponse*) override {
    return unary(*call, [&]() -> grpc::ServerUnaryReactor* {
      Outcome<std::shared_ptr<Session>> found = find(*call, request->session_id());
      if (!found) return finish(call, context_.refuse(found.fault()));
      delete_session(context_, std::move(found).value(), "deleted");
      return finish(call, grpc::Status::OK);
    });
  }

  grpc::ServerUnaryReactor* ChangeScene(grpc::CallbackServerContext* call,
                                        const v1::ChangeSceneRequest* request,
                                        v1::ChangeSceneResponse* response) override {
    return unary(*call, [&]() -> grpc::ServerUnaryReactor* {
      Outcome<std::shared_ptr<Session>> found = find(*call, request->session_id());
      if (!found) return finish(call, context_.refuse(found.fault()));
      Outcome<Lifecycle::Call> begun = context_.lifecycle.begin();
      if (!begun) return finish(call, context_.refuse(begun.fault()));
      const std::shared_ptr<Session> session = std::move(found).value();
      Outcome<ChangeOrder> order = change_order_from(*request, session->dtype());
      if (!order) return finish(call, context_.refuse(order.fault()));
      grpc::ServerUnaryReactor* reactor = call->DefaultReactor();
      // Shared, because a std::function must be copyable; released after the reactor was finished.
      auto in_flight = std::make_shared<Lifecycle::Call>(std::move(begun).value());
      auto [before, done] = recorded(
          session->recording(), *request,
          [&context = context_, reactor, response, session, in_flight](const Outcome<SessionState>& state) {
            answer(*reactor, [&] {
              if (!state) return context.refuse(state.fault());
              *response->mutable_session() = to_proto(*session);
              *response->mutable_state() = to_proto(state.value());
              return grpc::Status::OK;
            });
          });
      session->change(std::move(order).value(), std::move(done), std::move(before));
      return reactor;
    });
  }

  grpc::ServerUnaryReactor* CheckSession(grpc::CallbackServerContext* call,
                                         const v1::CheckSessionRequest* request,
                                         v1::CheckSessionResponse* response) override {
    return unary(*call, [&]() -> grpc::ServerUnaryReactor* {
      Outcome<std::shared_ptr<Session>> found = find(*call, request->session_id());
      if (!found) return finish(call, context_.refuse(found.fault()));
      Outcome<Lifecycle::Call> begun = context_.lifecycle.begin();
      if (!begun) return finish(call, context_.refuse(begun.fault()));
      grpc::ServerUnaryReactor* reactor = call->DefaultReactor();
      auto in_flight = std::make_shared<Lifecycle::Call>(std::move(begun).value());
      found.value()->check(
          [&context = context_, reactor, response, in_flight](const Outcome<std::string>& outcome) {
            answer(*reactor, [&] {
              if (outcome) response->set_found(outcome.value());
              return outcome ? grpc::Status::OK : context.refuse(outcome.fault());
            });
          });
      return reactor;
    });
  }

  grpc::ServerUnaryReactor* Step(grpc::CallbackServerContext* call, const grpc::ByteBuffer* request,
                                 grpc::ByteBuffer* response) override {
    return unary(*call, [&]() -> grpc::ServerUnaryReactor* {
      const Outcome<v1::StepRequest> message = parse_message<v1::StepRequest>(*request, "Step");
      if (!message) return finish(call, context_.refuse(message.fault()));
      return StepCall::start(context_, find(*call, message.value().session_id()), message.value(), *response);
    });
  }

  grpc::ServerBidiReactor<grpc::ByteBuffer, grpc::ByteBuffer>* StreamSteps(
      grpc::CallbackServerContext* call) override {
    return streaming<grpc::ServerBidiReactor<grpc::ByteBuffer, grpc::ByteBuffer>>(
        [&] { return StepStream::start(context_, *call); });
  }

  grpc::ServerUnaryReactor* GetServerInfo(grpc::CallbackServerContext* call, const v1::GetServerInfoRequest*,
                                          v1::GetServerInfoResponse* response) override {
    return unary(*call, [&]() -> grpc::ServerUnaryReactor* {
      if (const Outcome<Principal> principal = context_.guard.identify(*call); !principal)
        return finish(call, context_.refuse(principal.fault()));
      response->set_version(kVersion);
      *response->mutable_limits() = to_proto(context_.limits);
      response->set_threads(static_cast<std::uint32_t>(context_.workers->threads()));
      response->set_sessions(static_cast<std::uint32_t>(context_.store.size()));
      response->set_draining(context_.lifecycle.draining());
      response->set_charged_bytes(context_.budget.used());
      response->set_open_streams(context_.streams.inside());
      response->set_frames_in_flight(context_.frames.inside());
      const auto uptime = std::chrono::steady_clock::now() - context_.started;
      response->set_uptime_ms(
          static_cast<std::uint64_t>(std::chrono::duration_cast<std::chrono::milliseconds>(uptime).count()));
      return finish(call, grpc::Status::OK);
    });
  }

 private:
  Outcome<std::shared_ptr<Session>> find(const grpc::CallbackServerContext& call,
                                         const std::string& message_id) const {
    const Outcome<Principal> principal = context_.guard.identify(call);
    if (!principal) return principal.fault();
    Outcome<SessionId> id = session_id_of(message_id, session_metadata(call));
    if (!id) return id.fault();
    return context_.store.find(id.value(), principal.value().name);
  }

  Context& context_;
};

}  // namespace

std::unique_ptr<grpc::Service> make_collision_service(Context& context) {
  return std::make_unique<CollisionService>(context);
}

}  // namespace warmfront::server

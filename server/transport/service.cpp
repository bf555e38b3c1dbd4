// SPDX-License-Identifier: Apache-2.0
// The service's methods: the small ones here, the streaming ones in files of their own. Thread-safe.
#include "server/transport/service.h"

#include <grpcpp/grpcpp.h>

#include <utility>

#include "server/transport/convert.h"
#include "server/transport/create_call.h"
#include "server/transport/errors.h"
#include "server/transport/session_metadata.h"
#include "server/transport/step_stream.h"
#include "server/version.h"
#include "warmfront/v1/collision_service.grpc.pb.h"

namespace warmfront::server {
namespace {

/// StreamSteps takes its messages raw; the rest are typed.
using Base = v1::CollisionService::WithCallbackMethod_CreateSession<
    v1::CollisionService::WithCallbackMethod_GetSession<v1::CollisionService::WithCallbackMethod_ListSessions<
        v1::CollisionService::WithCallbackMethod_DeleteSession<v1::CollisionService::WithCallbackMethod_Step<
            v1::CollisionService::WithCallbackMethod_GetServerInfo<
                v1::CollisionService::WithRawCallbackMethod_StreamSteps<v1::CollisionService::Service>>>>>>>;

grpc::ServerUnaryReactor* finish(grpc::CallbackServerContext* call, const grpc::Status& status) {
  grpc::ServerUnaryReactor* reactor = call->DefaultReactor();
  reactor->Finish(status);
  return reactor;
}

class CollisionService final : public Base {
 public:
  explicit CollisionService(Context& context) : context_(context) {}

  grpc::ServerReadReactor<v1::CreateSessionRequest>* CreateSession(
      grpc::CallbackServerContext* call, v1::CreateSessionResponse* response) override {
    return CreateCall::start(context_, *call, *response);
  }

  grpc::ServerUnaryReactor* GetSession(grpc::CallbackServerContext* call,
                                       const v1::GetSessionRequest* request,
                                       v1::GetSessionResponse* response) override {
    Outcome<std::shared_ptr<Session>> session = find(*call, request->session_id());
    if (!session) return finish(call, to_grpc(session.fault()));
    *response->mutable_session() = to_proto(*session.value());
    return finish(call, grpc::Status::OK);
  }

  grpc::ServerUnaryReactor* ListSessions(grpc::CallbackServerContext* call, const v1::ListSessionsRequest*,
                                         v1::ListSessionsResponse* response) override {
    for (const std::shared_ptr<Session>& session : context_.store.list())
      *response->add_sessions() = to_proto(*session);
    return finish(call, grpc::Status::OK);
  }

  grpc::ServerUnaryReactor* DeleteSession(grpc::CallbackServerContext* call,
                                          const v1::DeleteSessionRequest* request,
                                          v1::DeleteSessionResponse*) override {
    Outcome<std::shared_ptr<Session>> found = find(*call, request->session_id());
    if (!found) return finish(call, to_grpc(found.fault()));
    std::shared_ptr<Session> session = std::move(found).value();
    context_.store.forget(*session);
    session->close({ErrorCode::kNotFound, Reason::kSessionNotFound,
                    "session " + session->id().text() + " was deleted; create it again"});
    context_.log.write(LogLevel::kInfo, "session_closed",
                       {{"session", session->id().text()}, {"reason", "deleted"}});
    // A large session takes a while to free: not in a reaction.
    context_.runner.post([doomed = std::move(session)] {});
    return finish(call, grpc::Status::OK);
  }

  grpc::ServerUnaryReactor* Step(grpc::CallbackServerContext* call, const v1::StepRequest* request,
                                 v1::StepResponse* response) override {
    Outcome<Lifecycle::Call> begun = context_.lifecycle.begin();
    if (!begun) return finish(call, to_grpc(begun.fault()));
    Outcome<std::shared_ptr<Session>> session = find(*call, request->session_id());
    if (!session) return finish(call, to_grpc(session.fault()));
    PositionBuffer positions(session.value()->dtype(), session.value()->scene().vertex_count());
    // An overflow is kept in the buffer, for the session to answer by its rules.
    static_cast<void>(positions.append(request->positions()));
    grpc::ServerUnaryReactor* reactor = call->DefaultReactor();
    // Shared, because a std::function must be copyable; released after the reactor was finished.
    auto in_flight = std::make_shared<Lifecycle::Call>(std::move(begun).value());
    session.value()->step(
        request->frame(), std::move(positions), Session::Admission::kBounded,
        [this, reactor, response, in_flight](const Outcome<std::shared_ptr<const Answer>>& outcome) {
          reactor->Finish(outcome ? respond(*outcome.value(), *response) : to_grpc(outcome.fault()));
        });
    return reactor;
  }

  grpc::ServerBidiReactor<grpc::ByteBuffer, grpc::ByteBuffer>* StreamSteps(
      grpc::CallbackServerContext* call) override {
    return StepStream::start(context_, *call);
  }

  grpc::ServerUnaryReactor* GetServerInfo(grpc::CallbackServerContext* call, const v1::GetServerInfoRequest*,
                                          v1::GetServerInfoResponse* response) override {
    response->set_version(kVersion);
    *response->mutable_limits() = to_proto(context_.limits);
    response->set_threads(static_cast<std::uint32_t>(context_.workers->threads()));
    response->set_sessions(static_cast<std::uint32_t>(context_.store.size()));
    response->set_draining(context_.lifecycle.draining());
    const auto uptime = std::chrono::steady_clock::now() - context_.started;
    response->set_uptime_ms(
        static_cast<std::uint64_t>(std::chrono::duration_cast<std::chrono::milliseconds>(uptime).count()));
    return finish(call, grpc::Status::OK);
  }

 private:
  Outcome<std::shared_ptr<Session>> find(const grpc::CallbackServerContext& call,
                                         const std::string& message_id) const {
    Outcome<SessionId> id = session_id_of(message_id, session_metadata(call));
    if (!id) return id.fault();
    return context_.store.find(id.value());
  }

  grpc::Status respond(const Answer& answer, v1::StepResponse& response) const {
    const std::size_t bytes = answer.rows() * Answer::kBytesPerRow;
    // The rest of the message is below a kilobyte.
    if (bytes + 1024 > context_.limits.max_message_bytes)
      return to_grpc(
          {ErrorCode::kResourceExhausted, Reason::kLimit,
           "frame " + std::to_string(answer.frame) + ": its answer of " + std::to_string(bytes) +
               " bytes does not fit into one message; send the frame again over StreamSteps for it"});
    response.set_frame(answer.frame);
    fill_columns(answer, 0, answer.rows(), *response.mutable_contacts());
    *response.mutable_summary() = summary_of(answer);
    return grpc::Status::OK;
  }

  Context& context_;
};

}  // namespace

std::unique_ptr<grpc::Service> make_collision_service(Context& context) {
  return std::make_unique<CollisionService>(context);
}

}  // namespace warmfront::server

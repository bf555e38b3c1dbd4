// SPDX-License-Identifier: Apache-2.0
// The service's methods: the small ones here, the streaming ones in files of their own. Thread-safe.
#include "server/transport/service.h"

#include <grpcpp/grpcpp.h>

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "proto/byte_buffer.h"
#include "server/transport/call_tag.h"
#include "server/transport/change_call.h"
#include "server/transport/convert.h"
#include "server/transport/create_call.h"
#include "server/transport/delete_session.h"
#include "server/transport/errors.h"
#include "server/transport/heavy.h"
#include "server/transport/pages.h"
#include "server/transport/raw_unary.h"
#include "server/transport/reaction.h"
#include "server/transport/session_metadata.h"
#include "server/transport/session_recording.h"
#include "server/transport/step_call.h"
#include "server/transport/step_stream.h"
#include "server/version.h"
#include "warmfront/v1/collision_service.grpc.pb.h"

namespace warmfront::server {
namespace {

/// All take their messages raw, and parse them where nothing is thrown out of and where it is known who
/// calls: gRPC parses typed ones on its own threads first, which memory that ends there takes the process
/// down with.
using Raw = v1::CollisionService;
using Base = Raw::WithRawCallbackMethod_CreateSession<
    Raw::WithRawCallbackMethod_GetSession<Raw::WithRawCallbackMethod_ListSessions<
        Raw::WithRawCallbackMethod_DeleteSession<Raw::WithRawCallbackMethod_ChangeScene<
            Raw::WithRawCallbackMethod_CheckSession<Raw::WithRawCallbackMethod_Step<
                Raw::WithRawCallbackMethod_GetServerInfo<Raw::WithRawCallbackMethod_StreamChangeScene<
                    Raw::WithRawCallbackMethod_StreamSteps<Raw::Service>>>>>>>>>>;

grpc::ServerUnaryReactor* finish(grpc::CallbackServerContext* call, grpc::Status status) {
  grpc::ServerUnaryReactor* reactor = call->DefaultReactor();
  finish_call(*reactor, std::move(status));
  return reactor;
}

/// Answers a ChangeScene call, which is in flight until its reactor was finished.
class ChangeReply final : public ChangeObserver {
 public:
  ChangeReply(Context& context, CancellableCall& reactor, grpc::ByteBuffer& response,
              std::shared_ptr<Session> session, Lifecycle::Call in_flight, ChangeRecord record)
      : context_(context),
        reactor_(reactor),
        response_(response),
        session_(std::move(session)),
        in_flight_(std::move(in_flight)),
        record_(std::move(record)) {}

  void begins() override { record_.begins(); }
  void answered(const Outcome<SessionState>& outcome) noexcept override {
    record_.answered(outcome);
    answer(reactor_, [&] {
      if (!outcome) return context_.refuse(outcome.fault());
      v1::ChangeSceneResponse reply;
      *reply.mutable_session() = to_proto(*session_);
      *reply.mutable_state() = to_proto(outcome.value());
      response_ = serialize(reply);
      return grpc::Status::OK;
    });
  }

 private:
  Context& context_;
  CancellableCall& reactor_;
  grpc::ByteBuffer& response_;
  const std::shared_ptr<Session> session_;
  const Lifecycle::Call in_flight_;
  ChangeRecord record_;
};

class CollisionService final : public Base {
 public:
  explicit CollisionService(Context& context) : context_(context) {}

  grpc::ServerReadReactor<grpc::ByteBuffer>* CreateSession(grpc::CallbackServerContext* call,
                                                           grpc::ByteBuffer* response) override {
    return streaming<grpc::ServerReadReactor<grpc::ByteBuffer>>([&] {
      context_.metrics.call_began("CreateSession");
      return CreateCall::start(context_, *call, *response);
    });
  }

  grpc::ServerUnaryReactor* GetSession(grpc::CallbackServerContext* call, const grpc::ByteBuffer* request,
                                       grpc::ByteBuffer* response) override {
    return respond<v1::GetSessionRequest, v1::GetSessionResponse>(
        *call, *request, *response, "GetSession", [&](const auto& received, auto& reply) {
          Outcome<std::shared_ptr<Session>> session = find(*call, received);
          if (!session) return context_.refuse(session.fault());
          *reply.mutable_session() = to_proto(*session.value());
          session.value()->touch();
          return grpc::Status::OK;
        });
  }

  grpc::ServerUnaryReactor* ListSessions(grpc::CallbackServerContext* call, const grpc::ByteBuffer* request,
                                         grpc::ByteBuffer* response) override {
    return respond<v1::ListSessionsRequest, v1::ListSessionsResponse>(
        *call, *request, *response, "ListSessions", [&](const auto& received, auto& reply) {
          std::vector<std::shared_ptr<Session>> sessions = context_.store.list();
          std::erase_if(sessions, [&](const std::shared_ptr<Session>& session) {
            return session->owner() != received.principal.name;
          });
          Outcome<std::string> next = add_page(sessions, received.message, [&](const Session& session) {
            *reply.add_sessions() = to_proto(session);
          });
          if (!next) return context_.refuse(next.fault());
          reply.set_next_page_token(std::move(next).value());
          return grpc::Status::OK;
        });
  }

  grpc::ServerUnaryReactor* DeleteSession(grpc::CallbackServerContext* call, const grpc::ByteBuffer* request,
                                          grpc::ByteBuffer* response) override {
    return respond<v1::DeleteSessionRequest, v1::DeleteSessionResponse>(
        *call, *request, *response, "DeleteSession", [&](const auto& received, auto&) {
          Outcome<std::shared_ptr<Session>> found = find(*call, received);
          if (!found) return context_.refuse(found.fault());
          delete_session(context_, std::move(found).value(), "deleted");
          return grpc::Status::OK;
        });
  }

  grpc::ServerUnaryReactor* ChangeScene(grpc::CallbackServerContext* call, const grpc::ByteBuffer* request,
                                        grpc::ByteBuffer* response) override {
    return found<v1::ChangeSceneRequest>(
        *call, *request, "ChangeScene",
        [this, response](CancellableCall& reactor, std::shared_ptr<Session> session, const auto& message) {
          Outcome<Lifecycle::Call> begun = context_.lifecycle.begin();
          if (!begun) return finish_call(reactor, context_.refuse(begun.fault()));
          Outcome<ChangeOrder> order =
              change_order_from(message, session->dtype(), context_.limits, session->account());
          if (!order) return finish_call(reactor, context_.refuse(order.fault()));
          order.value().given_up = reactor.given_up();
          ChangeRecord record(recording_of(*session), message, session->account());
          auto reply = std::make_unique<ChangeReply>(context_, reactor, *response, session,
                                                     std::move(begun).value(), std::move(record));
          session->change(std::move(order).value(), std::move(reply));
        });
  }

  grpc::ServerReadReactor<grpc::ByteBuffer>* StreamChangeScene(grpc::CallbackServerContext* call,
                                                               grpc::ByteBuffer* response) override {
    return streaming<grpc::ServerReadReactor<grpc::ByteBuffer>>([&] {
      context_.metrics.call_began("StreamChangeScene");
      return ChangeCall::start(context_, *call, *response);
    });
  }

  grpc::ServerUnaryReactor* CheckSession(grpc::CallbackServerContext* call, const grpc::ByteBuffer* request,
                                         grpc::ByteBuffer* response) override {
    return found<v1::CheckSessionRequest>(
        *call, *request, "CheckSession",
        [this, response](CancellableCall& reactor, const std::shared_ptr<Session>& session, const auto&) {
          Outcome<Lifecycle::Call> begun = context_.lifecycle.begin();
          if (!begun) return finish_call(reactor, context_.refuse(begun.fault()));
          auto in_flight = std::make_shared<Lifecycle::Call>(std::move(begun).value());
          session->check(
              [&context = context_, &reactor, response, in_flight](const Outcome<std::string>& outcome) {
                answer(reactor, [&] {
                  if (!outcome) return context.refuse(outcome.fault());
                  v1::CheckSessionResponse reply;
                  reply.set_found(outcome.value());
                  *response = serialize(reply);
                  return grpc::Status::OK;
                });
              },
              reactor.given_up());
        });
  }

  grpc::ServerUnaryReactor* Step(grpc::CallbackServerContext* call, const grpc::ByteBuffer* request,
                                 grpc::ByteBuffer* response) override {
    context_.metrics.call_began("Step");
    return unary(*call, [&]() -> grpc::ServerUnaryReactor* {
      Outcome<Principal> principal = context_.identify(*call);
      if (!principal) return finish(call, context_.refuse(principal.fault()));
      return StepCall::start(
          context_,
          is_heavy<v1::StepRequest>(*request, Strings::kCopied) ? context_.tenants.of(principal.value().name)
                                                                : nullptr,
          [this, call, request, principal]() -> Outcome<StepCall::Request> {
            auto received = receive_from<v1::StepRequest>(principal, context_, *request, "Step");
            if (!received) return received.fault();
            Outcome<std::shared_ptr<Session>> session = find(*call, received.value());
            if (!session) return session.fault();
            return StepCall::Request{std::move(received.value().place), std::move(session).value(),
                                     std::move(received.value().message),
                                     TraceContext::parse(traceparent(*call))};
          },
          *response);
    });
  }

  grpc::ServerBidiReactor<grpc::ByteBuffer, grpc::ByteBuffer>* StreamSteps(
      grpc::CallbackServerContext* call) override {
    return streaming<grpc::ServerBidiReactor<grpc::ByteBuffer, grpc::ByteBuffer>>([&] {
      context_.metrics.call_began("StreamSteps");
      return StepStream::start(context_, *call);
    });
  }

  grpc::ServerUnaryReactor* GetServerInfo(grpc::CallbackServerContext* call, const grpc::ByteBuffer* request,
                                          grpc::ByteBuffer* response) override {
    return respond<v1::GetServerInfoRequest, v1::GetServerInfoResponse>(
        *call, *request, *response, "GetServerInfo", [&](const auto& received, auto& reply) {
          const std::shared_ptr<Tenant> tenant = context_.tenants.of(received.principal.name);
          v1::PrincipalUse& use = *reply.mutable_principal();
          use.set_name(tenant->name);
          use.set_sessions(static_cast<std::uint32_t>(context_.store.count(tenant->name)));
          use.set_charged_bytes(tenant->memory.used());
          use.set_open_streams(tenant->streams.inside());
          use.set_frames_in_flight(tenant->frames.inside());
          use.set_weight(tenant->share.weight());
          reply.set_version(kVersion);
          reply.add_features(v1::FEATURE_PAIR_FILTERS);
          reply.add_features(v1::FEATURE_REDUCED_PROXIMITY);
          reply.add_features(v1::FEATURE_THICKNESS);
          reply.add_features(v1::FEATURE_KEEP_DISTANCE);
          reply.add_features(v1::FEATURE_EDGES);
          reply.add_features(v1::FEATURE_WORLDS);
          reply.add_features(v1::FEATURE_PLACE);
          reply.add_features(v1::FEATURE_HALF_SPACES);
          reply.add_features(v1::FEATURE_REPLACE);
          reply.add_features(v1::FEATURE_SCREW);
          reply.add_features(v1::FEATURE_OPTION_CHANGES);
          reply.add_features(v1::FEATURE_STREAMED_CHANGES);
          if (context_.memory_desk != nullptr) reply.add_features(v1::FEATURE_SHARED_MEMORY);
          *reply.mutable_limits() = to_proto(context_.limits, tenant->quota());
          reply.set_threads(static_cast<std::uint32_t>(context_.workers->threads()));
          reply.set_sessions(static_cast<std::uint32_t>(context_.store.size()));
          reply.set_draining(context_.lifecycle.draining());
          reply.set_charged_bytes(context_.budget.used());
          reply.set_open_streams(context_.streams.inside());
          reply.set_frames_in_flight(context_.frames.inside());
          const auto uptime = std::chrono::steady_clock::now() - context_.started;
          reply.set_uptime_ms(static_cast<std::uint64_t>(
              std::chrono::duration_cast<std::chrono::milliseconds>(uptime).count()));
          return grpc::Status::OK;
        });
  }

 private:
  /// A method that is answered at once; `fill` fills the response, and its status ends the call.
  template <class Request, class Response, class Fill>
  grpc::ServerUnaryReactor* respond(grpc::CallbackServerContext& call, const grpc::ByteBuffer& request,
                                    grpc::ByteBuffer& response, const char* method, Fill fill) {
    context_.metrics.call_began(method);
    return raw_unary<Request, Response>(
        context_, call, response, [&] { return receive<Request>(context_, call, request, method); }, fill);
  }

  /// A method of a session that is answered later; `begin` takes it from here, and the reactor with it. A
  /// heavy request is parsed in its principal's turn.
  template <class Request, class Begin>
  grpc::ServerUnaryReactor* found(grpc::CallbackServerContext& call, const grpc::ByteBuffer& request,
                                  const char* method, Begin begin) {
    context_.metrics.call_began(method);
    return unary(call, [&]() -> grpc::ServerUnaryReactor* {
      Outcome<Principal> principal = context_.identify(call);
      if (!principal) return finish(&call, context_.refuse(principal.fault()));
      auto made = std::make_unique<CancellableCall>();
      CancellableCall& reactor = *made;
      const auto failed = [&reactor](grpc::Status status) { finish_call(reactor, std::move(status)); };
      const auto work = [this, &reactor, &call, &request, method, principal, begin, failed] {
        react(
            [&] {
              const auto received = receive_from<Request>(principal, context_, request, method);
              if (!received) return failed(context_.refuse(received.fault()));
              Outcome<std::shared_ptr<Session>> session = find(call, received.value());
              if (!session) return failed(context_.refuse(session.fault()));
              begin(reactor, std::move(session).value(), received.value().message);
            },
            failed);
      };
      if (kIsSmall<Request> || !is_heavy<Request>(request, Strings::kCopied))
        work();
      else
        run_in_turn(context_, context_.tenants.of(principal.value().name), work);
      return made.release();
    });
  }

  template <class Request>
  Outcome<std::shared_ptr<Session>> find(const grpc::CallbackServerContext& call,
                                         const Received<Request>& received) const {
    Outcome<SessionId> id = session_id_of(received.message.session_id(), session_metadata(call));
    if (!id) return id.fault();
    return context_.store.find(id.value(), received.principal.name);
  }

  Context& context_;
};

}  // namespace

std::unique_ptr<grpc::Service> make_collision_service(Context& context) {
  // Descriptors are built when they are first asked for, which takes milliseconds: not in a call.
  MessageLayout::of(*v1::CreateSessionRequest::descriptor());
  MessageLayout::of(*v1::StreamStepsRequest::descriptor());
  return std::make_unique<CollisionService>(context);
}

}  // namespace warmfront::server

// SPDX-License-Identifier: Apache-2.0
// The connections to a daemon and its small calls. Thread-safe. A call ends early when `look`, which is
// called while it is waited for, throws.
#pragma once

#include <grpcpp/grpcpp.h>

#include <chrono>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "client/lib/channel_pool.h"
#include "client/lib/client.h"
#include "client/lib/look.h"
#include "client/lib/security.h"
#include "client/lib/wire.h"
#include "warmfront/v1/admin_service.grpc.pb.h"
#include "warmfront/v1/collision_service.grpc.pb.h"

namespace warmfront::client {

class Connection {
 public:
  Connection(const std::string& address, const ClientOptions& options, const Credentials& credentials);

  const ClientOptions& options() const { return options_; }
  /// Of shared memory, where the daemon may be asked for it.
  std::optional<std::string> memory_socket() const;
  /// Reserves a long-lived call on a connection with room.
  ChannelPool::Lease channel() { return channels_.take(); }
  /// Adds the credentials, the session id if any, and this traceparent or else that of the options, to a
  /// call's context. Every call must use it.
  void prepare(grpc::ClientContext& context, const std::string& session_id = {},
               const std::string& traceparent = {}) const;

  /// Both wait for a daemon up to their timeout, and store its limits. With a session id, of the daemon that
  /// serves that session.
  std::optional<RemoteError> server_info(v1::GetServerInfoResponse& response,
                                         const std::string& session_id = {}, const Look& look = {});
  /// kUnimplemented where the daemon that serves this session lacks one of the features: kinds of input that
  /// it would ignore.
  std::optional<RemoteError> need(std::span<const v1::Feature> features, const std::string& session_id,
                                  const Look& look = {});
  /// Uploads the scene. `positions` are the bytes as in step.proto. Fails as need() for a header that
  /// announces what needs a feature.
  std::optional<RemoteError> create(const v1::SessionHeader& header, const SceneDescription& scene,
                                    std::string_view positions, v1::CreateSessionResponse& response,
                                    const Look& look = {});

  /// All pages; so list_all().
  std::optional<RemoteError> list(v1::ListSessionsResponse& response);
  std::optional<RemoteError> get(const std::string& id, v1::GetSessionResponse& response);
  std::optional<RemoteError> check(const std::string& id, v1::CheckSessionResponse& response);
  std::optional<RemoteError> remove(const std::string& id, const Look& look = {});
  std::optional<RemoteError> change(const v1::ChangeSceneRequest& request, v1::ChangeSceneResponse& response);
  std::optional<RemoteError> list_all(v1::ListAllSessionsResponse& response);
  std::optional<RemoteError> remove_any(const std::string& id, const std::string& principal);

 private:
  template <class Stub, class Request, class Response>
  using UnaryMethod = std::unique_ptr<grpc::ClientAsyncResponseReader<Response>> (Stub::*)(
      grpc::ClientContext*, const Request&, grpc::CompletionQueue*);

  template <class Request, class Response>
  using UploadMethod = std::unique_ptr<grpc::ClientAsyncWriter<Request>> (v1::CollisionService::Stub::*)(
      grpc::ClientContext*, Response*, grpc::CompletionQueue*);

  // A call whose request is a stream: `pieces(send)` sends it, and stops where `send` returns false.
  template <class Request, class Response, class Pieces>
  std::optional<RemoteError> upload(UploadMethod<Request, Response> method, const std::string& session_id,
                                    Response& response, bool wait_for_ready, const Look& look, Pieces pieces);
  std::optional<RemoteError> change_in_pieces(v1::ChangeSceneRequest request,
                                              v1::ChangeSceneResponse& response);

  // gRPC's reason why no connection can be established; none if one can.
  std::optional<std::string> why_unreachable(const Look& look);

  // A unary call; about a session, if one is named.
  template <class Stub, class Request, class Response>
  std::optional<RemoteError> call(UnaryMethod<Stub, Request, Response> method,
                                  const std::type_identity_t<Request>& request, Response& response,
                                  const std::string& session_id = {},
                                  std::optional<std::chrono::milliseconds> timeout = std::nullopt,
                                  const Look& look = {});
  template <class Stub, class Request, class Response>
  grpc::Status answered(grpc::ClientContext& context, UnaryMethod<Stub, Request, Response> method,
                        const std::type_identity_t<Request>& request, Response& response, const Look& look);

  // Constant after construction.
  const std::string address_;
  const ClientOptions options_;
  const std::string authorization_;
  const bool encrypted_;

  // Thread-safe.
  ChannelPool channels_;
};

}  // namespace warmfront::client

// SPDX-License-Identifier: Apache-2.0
// The connections to a daemon and its small calls. Thread-safe.
#pragma once

#include <grpcpp/grpcpp.h>

#include <chrono>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "client/lib/channel_pool.h"
#include "client/lib/client.h"
#include "client/lib/security.h"
#include "client/lib/wire.h"
#include "warmfront/v1/admin_service.grpc.pb.h"
#include "warmfront/v1/collision_service.grpc.pb.h"

namespace warmfront::client {

class Connection {
 public:
  Connection(const std::string& address, const ClientOptions& options, const Credentials& credentials);

  const ClientOptions& options() const { return options_; }
  /// Room for a call that lasts, on a connection that has some.
  ChannelPool::Lease channel() { return channels_.take(); }
  /// Every call's context comes by here: says who calls, and which session it is about, if any.
  void prepare(grpc::ClientContext& context, const std::string& session_id = {}) const;

  /// Both wait for a daemon that is not there yet, up to their timeout. What it allows holds from then on;
  /// the daemon where that session is to be, if one is named.
  std::optional<RemoteError> server_info(v1::GetServerInfoResponse& response,
                                         const std::string& session_id = {});
  /// Uploads the scene. `positions` are the bytes as in step.proto.
  std::optional<RemoteError> create(const v1::SessionHeader& header, const SceneDescription& scene,
                                    std::string_view positions, v1::CreateSessionResponse& response);

  std::optional<RemoteError> list(v1::ListSessionsResponse& response);
  std::optional<RemoteError> get(const std::string& id, v1::GetSessionResponse& response);
  std::optional<RemoteError> check(const std::string& id, v1::CheckSessionResponse& response);
  std::optional<RemoteError> remove(const std::string& id);
  std::optional<RemoteError> change(const v1::ChangeSceneRequest& request, v1::ChangeSceneResponse& response);
  std::optional<RemoteError> list_all(v1::ListAllSessionsResponse& response);
  std::optional<RemoteError> remove_any(const std::string& id, const std::string& principal);

 private:
  template <class Stub, class Request, class Response>
  using UnaryMethod = grpc::Status (Stub::*)(grpc::ClientContext*, const Request&, Response*);

  // What gRPC says of a connection that cannot be had; nothing when one can.
  std::optional<std::string> why_unreachable();

  // A call of one message and one answer; about a session, if one is named.
  template <class Stub, class Request, class Response>
  std::optional<RemoteError> call(UnaryMethod<Stub, Request, Response> method,
                                  const std::type_identity_t<Request>& request, Response& response,
                                  const std::string& session_id = {},
                                  std::optional<std::chrono::milliseconds> timeout = std::nullopt);

  // Constant after construction.
  const std::string address_;
  const ClientOptions options_;
  const std::string authorization_;

  // Thread-safe.
  ChannelPool channels_;
};

}  // namespace warmfront::client

// SPDX-License-Identifier: Apache-2.0
// The unary calls, and the upload. Thread safety as stated in the header.
#include "client/lib/connection.h"

#include <algorithm>
#include <utility>

#include "client/lib/features.h"
#include "client/lib/socket_buffer.h"
#include "proto/wire/scene_change_pieces.h"
#include "proto/wire/shared_columns.h"

namespace warmfront::client {
namespace {

/// For a first upload, before the daemon's answer states its message limit: well below the least limit, 64
/// KiB.
constexpr std::size_t kUploadChunk = 60 << 10;

/// Sessions a page: below the least limit likewise.
constexpr std::int32_t kPageSize = 100;

/// One response of the sessions of all pages; `call(request, page)` gets one.
template <class Request, class Response, class Call>
std::optional<RemoteError> all_pages(Call&& call, Response& response) {
  Request request;
  request.set_page_size(kPageSize);
  do {
    Response page;
    if (std::optional<RemoteError> error = call(request, page)) return error;
    response.mutable_sessions()->MergeFrom(page.sessions());
    request.set_page_token(page.next_page_token());
  } while (!request.page_token().empty());
  return std::nullopt;
}

/// gRPC retries idempotent calls when the connection breaks or the daemon restarts (about two seconds);
/// deleting a session twice is harmless. Steps, uploads and changes are resumed in session_resume.cpp.
constexpr char kServiceConfig[] = R"({"methodConfig": [{
  "name": [{"service": "warmfront.v1.CollisionService", "method": "GetServerInfo"},
           {"service": "warmfront.v1.CollisionService", "method": "DeleteSession"},
           {"service": "warmfront.v1.CollisionService", "method": "GetSession"},
           {"service": "warmfront.v1.CollisionService", "method": "ListSessions"}],
  "retryPolicy": {"maxAttempts": 5, "initialBackoff": "0.1s", "maxBackoff": "1s", "backoffMultiplier": 2,
                  "retryableStatusCodes": ["UNAVAILABLE"]}}]})";

grpc::ChannelArguments channel_arguments(const std::string& server_name) {
  grpc::ChannelArguments arguments;
  // The daemon chooses the size of an answer's chunks.
  arguments.SetMaxReceiveMessageSize(-1);
  // One connection per channel: a connection is bound to about one core.
  arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
  arguments.SetInt(GRPC_ARG_INITIAL_RECONNECT_BACKOFF_MS, 100);
  // Sooner than the last retry of a call: else it fails though the daemon is there again.
  arguments.SetInt(GRPC_ARG_MAX_RECONNECT_BACKOFF_MS, 1000);
  // Despite its name this is the time limit for connecting, handshakes included: three round trips on a
  // possibly slow line, to a possibly busy daemon.
  arguments.SetInt(GRPC_ARG_MIN_RECONNECT_BACKOFF_MS, 10'000);
  // Detects a daemon that vanished silently within a minute; daemons allow a ping every ten seconds.
  arguments.SetInt(GRPC_ARG_KEEPALIVE_TIME_MS, 30'000);
  arguments.SetInt(GRPC_ARG_KEEPALIVE_TIMEOUT_MS, 20'000);
  // Ignore a web proxy from the environment: the address is that of the daemon or of its own proxy.
  arguments.SetInt(GRPC_ARG_ENABLE_HTTP_PROXY, 0);
  enlarge_send_buffer(arguments);
  arguments.SetServiceConfigJSON(kServiceConfig);
  if (!server_name.empty()) arguments.SetSslTargetNameOverride(server_name);
  return arguments;
}

void set_deadline(grpc::ClientContext& context, std::chrono::milliseconds timeout) {
  context.set_deadline(deadline_after(timeout));
}

/// Of one call: its operations, begun and waited for one after the other. What they refer to must outlive it.
class Operations {
 public:
  Operations(grpc::ClientContext& context, const Look& look) : context_(context), look_(look) {}
  ~Operations() {
    context_.TryCancel();
    queue_.Shutdown();
    void* done = nullptr;
    bool ok = false;
    while (queue_.Next(&done, &ok)) {
    }
  }
  Operations(const Operations&) = delete;
  Operations& operator=(const Operations&) = delete;

  grpc::CompletionQueue* queue() { return &queue_; }
  /// Waits for the operation in progress, which the context's deadline ends: did it succeed?
  bool succeeded() {
    void* done = nullptr;
    bool ok = false;
    return next_event(queue_, done, ok, std::chrono::system_clock::time_point::max(), look_) && ok;
  }

 private:
  grpc::ClientContext& context_;
  const Look& look_;
  grpc::CompletionQueue queue_;
};

}  // namespace

Connection::Connection(const std::string& address, const ClientOptions& options,
                       const Credentials& credentials)
    : address_(address),
      options_(options),
      authorization_(credentials.authorization),
      encrypted_(credentials.encrypted),
      channels_([address, credentials] {
        return grpc::CreateCustomChannel(address, credentials.channel,
                                         channel_arguments(credentials.server_name));
      }) {}

std::optional<std::string> Connection::memory_socket() const {
  constexpr std::string_view kUnix = "unix:";
  if (!options_.shared_memory || !address_.starts_with(kUnix)) return std::nullopt;
  return address_.substr(kUnix.size()) + wire::kSharedMemorySuffix;
}

void Connection::prepare(grpc::ClientContext& context, const std::string& session_id,
                         const std::string& traceparent) const {
  if (!authorization_.empty()) context.AddMetadata("authorization", authorization_);
  if (!session_id.empty()) context.AddMetadata("warmfront-session", session_id);
  const std::string& span = traceparent.empty() ? options_.traceparent : traceparent;
  if (!span.empty()) context.AddMetadata("traceparent", span);
}

template <class Stub, class Request, class Response>
grpc::Status Connection::answered(grpc::ClientContext& context, UnaryMethod<Stub, Request, Response> method,
                                  const std::type_identity_t<Request>& request, Response& response,
                                  const Look& look) {
  const ChannelPool::Lease channel = channels_.take();
  grpc::Status status;
  std::unique_ptr<grpc::ClientAsyncResponseReader<Response>> reader;
  Operations operations(context, look);
  if constexpr (std::is_same_v<Stub, v1::AdminService::Stub>)
    reader = (*channel->admin.*method)(&context, request, operations.queue());
  else
    reader = (*channel->service.*method)(&context, request, operations.queue());
  reader->StartCall();
  reader->Finish(&response, &status, nullptr);
  static_cast<void>(operations.succeeded());  // the status says
  return status;
}

std::optional<RemoteError> Connection::server_info(v1::GetServerInfoResponse& response,
                                                   const std::string& session_id, const Look& look) {
  grpc::ClientContext context;
  set_deadline(context, options_.call_timeout);
  context.set_wait_for_ready(true);
  prepare(context, session_id);
  const grpc::Status status =
      answered(context, &v1::CollisionService::Stub::PrepareAsyncGetServerInfo, {}, response, look);
  if (status.ok()) {
    channels_.set_calls_per_channel(response.limits().max_streams());
    return std::nullopt;
  }
  RemoteError remote = remote_error_from(status);
  if (remote.error.code == ErrorCode::kDeadlineExceeded) remote.error.code = ErrorCode::kUnavailable;
  if (remote.error.code != ErrorCode::kUnavailable) return remote;
  const std::string why = why_unreachable(look).value_or(remote.error.message);
  remote.error.message =
      address_ + ": no Warmfront daemon answers (" + why + "); " + what_to_try(why, encrypted_);
  return remote;
}

std::optional<std::string> Connection::why_unreachable(const Look& look) {
  // Only a call that does not wait for the connection learns why it failed.
  grpc::ClientContext context;
  set_deadline(context, std::chrono::seconds(2));
  prepare(context);
  v1::GetServerInfoResponse ignored;
  const grpc::Status status =
      answered(context, &v1::CollisionService::Stub::PrepareAsyncGetServerInfo, {}, ignored, look);
  if (status.error_code() != grpc::StatusCode::UNAVAILABLE) return std::nullopt;
  return status.error_message();
}

std::optional<RemoteError> Connection::need(std::span<const v1::Feature> features,
                                            const std::string& session_id, const Look& look) {
  if (features.empty()) return std::nullopt;
  v1::GetServerInfoResponse info;
  if (std::optional<RemoteError> error = server_info(info, session_id, look)) return error;
  for (const v1::Feature feature : features) {
    if (std::ranges::count(info.features(), feature) == 0) return too_old_for(feature);
  }
  return std::nullopt;
}

template <class Request, class Response, class Pieces>
std::optional<RemoteError> Connection::upload(UploadMethod<Request, Response> method,
                                              const std::string& session_id, Response& response,
                                              bool wait_for_ready, const Look& look, Pieces pieces) {
  grpc::ClientContext context;
  set_deadline(context, options_.create_timeout);
  context.set_wait_for_ready(wait_for_ready);
  prepare(context, session_id);
  const ChannelPool::Lease channel = channels_.take();
  grpc::Status status;
  std::unique_ptr<grpc::ClientAsyncWriter<Request>> upload;
  Operations operations(context, look);
  upload = (*channel->service.*method)(&context, &response, operations.queue());
  upload->StartCall(nullptr);
  const bool started = operations.succeeded();
  // When a write fails, the status has the reason.
  const auto send = [&](const Request& piece) {
    upload->Write(piece, nullptr);
    return operations.succeeded();
  };
  if (started) {
    static_cast<void>(pieces(send));
    upload->WritesDone(nullptr);
    static_cast<void>(operations.succeeded());
  }
  upload->Finish(&status, nullptr);
  static_cast<void>(operations.succeeded());
  if (!status.ok()) return remote_error_from(status);
  return std::nullopt;
}

std::optional<RemoteError> Connection::create(const v1::SessionHeader& header, const SceneDescription& scene,
                                              std::string_view positions, v1::CreateSessionResponse& response,
                                              const Look& look) {
  const std::vector<v1::Feature> features = features_in(header);
  if (std::optional<RemoteError> error = need(features, header.session_id(), look)) return error;
  v1::CreateSessionRequest request;
  *request.mutable_header() = header;
  using Request = v1::CreateSessionRequest;
  const auto pieces = [&](const auto& send) {
    return send(request) &&
           wire::send_chunks(wire::as_bytes(scene.faces), kUploadChunk, send,
                             [](Request& to, std::string piece) { to.set_faces(std::move(piece)); }) &&
           wire::send_chunks(wire::as_bytes(scene.edges), kUploadChunk, send,
                             [](Request& to, std::string piece) { to.set_edges(std::move(piece)); }) &&
           wire::send_chunks(positions, kUploadChunk, send,
                             [](Request& to, std::string piece) { to.set_positions(std::move(piece)); }) &&
           wire::upload_thickness(scene.thickness, kUploadChunk, send) &&
           wire::upload(scene.filters, kUploadChunk, send);
  };
  if (std::optional<RemoteError> error =
          upload<Request>(&v1::CollisionService::Stub::PrepareAsyncCreateSession, header.session_id(),
                          response, true, look, pieces))
    return error;
  // Another daemon than the one that was asked, behind a proxy, would take the scene without what it does not
  // know of. Filters that leave nothing out are none.
  for (const v1::Feature feature : features) {
    const bool matters = feature != v1::FEATURE_PAIR_FILTERS || scene.filters.any();
    if (!matters || took(response.session(), feature)) continue;
    static_cast<void>(remove(header.session_id()));
    return too_old_for(feature);
  }
  return std::nullopt;
}

template <class Stub, class Request, class Response>
std::optional<RemoteError> Connection::call(UnaryMethod<Stub, Request, Response> method,
                                            const std::type_identity_t<Request>& request, Response& response,
                                            const std::string& session_id,
                                            std::optional<std::chrono::milliseconds> timeout,
                                            const Look& look) {
  grpc::ClientContext context;
  set_deadline(context, timeout.value_or(options_.call_timeout));
  prepare(context, session_id);
  const grpc::Status status = answered(context, method, request, response, look);
  if (!status.ok()) return remote_error_from(status);
  return std::nullopt;
}

std::optional<RemoteError> Connection::change(const v1::ChangeSceneRequest& request,
                                              v1::ChangeSceneResponse& response) {
  // In pieces where it is large, unless the daemon is older than that.
  const v1::Feature streamed = v1::FEATURE_STREAMED_CHANGES;
  if (request.ByteSizeLong() > kUploadChunk && !need({&streamed, 1}, request.session_id()))
    return change_in_pieces(request, response);
  return call(&v1::CollisionService::Stub::PrepareAsyncChangeScene, request, response, request.session_id(),
              options_.create_timeout);
}

std::optional<RemoteError> Connection::change_in_pieces(v1::ChangeSceneRequest request,
                                                        v1::ChangeSceneResponse& response) {
  return upload<v1::ChangeSceneRequest>(
      &v1::CollisionService::Stub::PrepareAsyncStreamChangeScene, request.session_id(), response, false, {},
      [&](const auto& send) { return wire::send_pieces(std::move(request), kUploadChunk, send); });
}

std::optional<RemoteError> Connection::list(v1::ListSessionsResponse& response) {
  return all_pages<v1::ListSessionsRequest>(
      [&](const auto& request, auto& page) {
        return call(&v1::CollisionService::Stub::PrepareAsyncListSessions, request, page);
      },
      response);
}

std::optional<RemoteError> Connection::get(const std::string& id, v1::GetSessionResponse& response) {
  v1::GetSessionRequest request;
  request.set_session_id(id);
  return call(&v1::CollisionService::Stub::PrepareAsyncGetSession, request, response, id);
}

std::optional<RemoteError> Connection::check(const std::string& id, v1::CheckSessionResponse& response) {
  v1::CheckSessionRequest request;
  request.set_session_id(id);
  return call(&v1::CollisionService::Stub::PrepareAsyncCheckSession, request, response, id);
}

std::optional<RemoteError> Connection::remove(const std::string& id, const Look& look) {
  v1::DeleteSessionRequest request;
  request.set_session_id(id);
  v1::DeleteSessionResponse response;
  return call(&v1::CollisionService::Stub::PrepareAsyncDeleteSession, request, response, id, std::nullopt,
              look);
}

std::optional<RemoteError> Connection::list_all(v1::ListAllSessionsResponse& response) {
  return all_pages<v1::ListAllSessionsRequest>(
      [&](const auto& request, auto& page) {
        return call(&v1::AdminService::Stub::PrepareAsyncListAllSessions, request, page);
      },
      response);
}

std::optional<RemoteError> Connection::remove_any(const std::string& id, const std::string& principal) {
  v1::DeleteAnySessionRequest request;
  request.set_session_id(id);
  if (!principal.empty()) request.set_principal(principal);
  v1::DeleteAnySessionResponse response;
  return call(&v1::AdminService::Stub::PrepareAsyncDeleteAnySession, request, response, id);
}

}  // namespace warmfront::client

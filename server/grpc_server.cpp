// SPDX-License-Identifier: Apache-2.0
#include "server/grpc_server.h"

#include <google/protobuf/stubs/logging.h>
#include <grpcpp/ext/channelz_service_plugin.h>
#include <grpcpp/ext/proto_server_reflection_plugin.h>
#include <grpcpp/grpcpp.h>
#include <grpcpp/impl/codegen/service_type.h>
#include <grpcpp/resource_quota.h>
#include <grpcpp/security/server_credentials.h>
#include <grpcpp/security/tls_certificate_provider.h>
#include <grpcpp/security/tls_credentials_options.h>

#include <algorithm>
#include <utility>

#include "server/annotations.h"
#include "server/process/listen.h"

namespace warmfront::server {
namespace {

void set_arguments(grpc::ServerBuilder& builder, const Config& config) {
  const int message_bytes = static_cast<int>(config.limits.max_message_bytes);
  builder.SetMaxReceiveMessageSize(message_bytes);
  // An answer chunk holds at most answer_chunk_bytes of contacts, or one row, and a summary.
  builder.SetMaxSendMessageSize(
      static_cast<int>(std::max(config.limits.max_message_bytes, config.limits.answer_chunk_bytes + 4096)));
  // The message limit alone does not bound memory: a message is buffered whole before it is refused.
  builder.SetResourceQuota(grpc::ResourceQuota("warmfrontd").Resize(config.transport_memory_bytes));
  // The quota does not see what a compressed message becomes.
  builder.SetCompressionAlgorithmSupportStatus(GRPC_COMPRESS_DEFLATE, false);
  builder.SetCompressionAlgorithmSupportStatus(GRPC_COMPRESS_GZIP, false);
  // Two daemons would otherwise share a port in silence.
  builder.AddChannelArgument(GRPC_ARG_ALLOW_REUSEPORT, 0);
  builder.AddChannelArgument(GRPC_ARG_MAX_CONCURRENT_STREAMS,
                             static_cast<int>(config.limits.max_streams_per_connection));
  builder.AddChannelArgument(GRPC_ARG_MAX_METADATA_SIZE, static_cast<int>(config.max_metadata_bytes));
  builder.AddChannelArgument(GRPC_ARG_SERVER_HANDSHAKE_TIMEOUT_MS, 10'000);
  // Clients that vanish are found within a minute and a half; clients may ping every ten seconds.
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_TIME_MS, 60'000);
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_TIMEOUT_MS, 30'000);
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_PERMIT_WITHOUT_CALLS, 1);
  builder.AddChannelArgument(GRPC_ARG_HTTP2_MIN_RECV_PING_INTERVAL_WITHOUT_DATA_MS, 10'000);
}

/// gRPC reads the files again every second. They are not those of the user, which may be anything by then:
/// Debian's gRPC 1.51 ends the process for an empty one.
std::shared_ptr<grpc::ServerCredentials> encrypted_by(const TlsFiles& files) {
  constexpr unsigned kReloadSeconds = 1;
  using namespace grpc::experimental;
  TlsServerCredentialsOptions options(std::make_shared<FileWatcherCertificateProvider>(
      files.key, files.certificate, files.client_ca, kReloadSeconds));
  options.watch_identity_key_cert_pairs();
  if (!files.client_ca.empty()) {
    options.watch_root_certs();
    options.set_cert_request_type(GRPC_SSL_REQUEST_AND_REQUIRE_CLIENT_CERTIFICATE_AND_VERIFY);
  }
  return TlsServerCredentials(options);
}

}  // namespace

void enable_plugins(bool reflection, bool channelz) {
  static Mutex mutex;
  static bool reflecting = false, channels = false;
  const MutexLock lock(mutex);
  // It writes what clients send wrong to standard error in lines of its own; the status that they get says it
  // all.
  google::protobuf::SetLogHandler(nullptr);
  if (reflection && !std::exchange(reflecting, true))
    grpc::reflection::InitProtoReflectionServerBuilderPlugin();
  if (channelz && !std::exchange(channels, true)) grpc::channelz::experimental::InitChannelzService();
}

bool uses_tls(const std::string& address, const TlsFiles& tls) {
  return tls.enabled() && !address.starts_with("unix:");
}

std::string with_port(const std::string& address, int port) {
  return address.starts_with("unix:") ? address
                                      : address.substr(0, address.rfind(':') + 1) + std::to_string(port);
}

Result<ListeningServer> listen_and_serve(const Config& config, const TlsFiles* files,
                                         std::span<grpc::Service* const> services) {
  grpc::ServerBuilder builder;
  set_arguments(builder, config);
  const std::shared_ptr<grpc::ServerCredentials> plain = grpc::InsecureServerCredentials();
  const std::shared_ptr<grpc::ServerCredentials> encrypted =
      files != nullptr ? encrypted_by(*files) : nullptr;
  std::vector<int> ports(config.listen.size(), 0);
  for (std::size_t i = 0; i < ports.size(); ++i)
    builder.AddListeningPort(config.listen[i], uses_tls(config.listen[i], config.tls) ? encrypted : plain,
                             &ports[i]);
  for (grpc::Service* const service : services) builder.RegisterService(service);
  ListeningServer listening{builder.BuildAndStart(), {}};
  if (!listening.server) {
    // gRPC does not say why; the first port that it did not get is the reason.
    const auto failed = static_cast<std::size_t>(std::find(ports.begin(), ports.end(), 0) - ports.begin());
    const std::string& address = config.listen[std::min(failed, ports.size() - 1)];
    return Error{ErrorCode::kUnavailable, "listen " + address + ": " + why_not_bound(address)};
  }
  for (std::size_t i = 0; i < ports.size(); ++i)
    listening.addresses.push_back(with_port(config.listen[i], ports[i]));
  return listening;
}

}  // namespace warmfront::server

// SPDX-License-Identifier: Apache-2.0
// gRPC's server as the configuration has it: limits, addresses, encryption. Called by one thread.
#pragma once

#include <memory>
#include <span>
#include <string>
#include <vector>

#include "engine/result.h"
#include "server/config.h"

namespace grpc {
class Server;
class Service;
}  // namespace grpc

namespace warmfront::server {

/// Plugins are switches of the whole process in gRPC: once on, every server that is built later has them.
void enable_plugins(bool reflection, bool channelz);

bool uses_tls(const std::string& address, const TlsFiles& tls);
/// HOST:PORT with the port that was given, where it asked for any.
std::string with_port(const std::string& address, int port);

struct ListeningServer {
  std::unique_ptr<grpc::Server> server;
  std::vector<std::string> addresses;  ///< of config.listen, with their ports
};
/// Listens and serves. `files`: the certificates in force, none without TLS. kUnavailable, with the system's
/// reason, for an address that cannot be bound. The services outlive the server.
Result<ListeningServer> listen_and_serve(const Config& config, const TlsFiles* files,
                                         std::span<grpc::Service* const> services);

}  // namespace warmfront::server

// SPDX-License-Identifier: Apache-2.0
// Addresses to listen on: what they reach, whether they may be used, and why they cannot be. Thread-safe.
#pragma once

#include <optional>
#include <string>

#include "engine/result.h"

namespace warmfront::server {

/// Whether only this machine can reach the address: a Unix socket, or a loopback host.
bool is_local(const std::string& address);

/// The PATH of unix:PATH; nothing of another address.
std::optional<std::string> unix_path(const std::string& address);

/// Whether a process accepts connections on the Unix socket.
bool someone_listens(const std::string& path);

/// INVALID_ARGUMENT for an address that is neither HOST:PORT nor unix:PATH; FAILED_PRECONDITION for one that
/// others can reach unless `secured`, by TLS or because the user says so.
Status check_listen_address(const std::string& address, bool secured);

/// Whether it is HOST:PORT, an IPv6 host in brackets.
bool is_host_and_port(const std::string& address);

/// What to say of an address of which gRPC, or the HTTP listener, only says that it was not bound: tries it
/// once more, for the system's reason.
std::string why_not_bound(const std::string& address);

}  // namespace warmfront::server

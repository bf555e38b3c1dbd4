// SPDX-License-Identifier: Apache-2.0
// Addresses to listen on: what they reach, and whether they may be used. Thread-safe.
#pragma once

#include <string>

#include "engine/result.h"

namespace warmfront::server {

/// Whether only this machine can reach the address: a Unix socket, or a loopback host.
bool is_local(const std::string& address);

/// INVALID_ARGUMENT for an address that is neither HOST:PORT nor unix:PATH; FAILED_PRECONDITION for one that
/// others can reach unless `secured`, by TLS or because the user says so, and for a Unix socket on which
/// another daemon listens (gRPC would take it away silently).
Status check_listen_address(const std::string& address, bool secured);

}  // namespace warmfront::server

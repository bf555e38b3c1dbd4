// SPDX-License-Identifier: Apache-2.0
// What gRPC says of itself (handshakes that failed, ports that it did not get) joins the daemon's log.
#pragma once

#include <string_view>

#include "server/log.h"

namespace warmfront::server {

/// Events named "grpc" from now on, of the level that GRPC_VERBOSITY allows (errors by default), and
/// "handshake_failed", with what is likely to be wrong, for TLS connections that did not come about. The same
/// words come once a second at most. For all of the process; `log` outlives it. Thread-safe.
void log_what_grpc_says(Log& log);

/// What a failed TLS handshake is likely to come from, by gRPC's (OpenSSL's) words; empty for words that are
/// not of a failed handshake. Thread-safe.
std::string_view why_handshake_failed(std::string_view said);

}  // namespace warmfront::server

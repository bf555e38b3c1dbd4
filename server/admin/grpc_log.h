// SPDX-License-Identifier: Apache-2.0
// What gRPC says of itself (handshakes that failed, ports that it did not get) joins the daemon's log.
#pragma once

#include "server/log.h"

namespace warmfront::server {

/// Events named "grpc" from now on, of the level that GRPC_VERBOSITY allows (errors by default). For all of
/// the process; `log` outlives it. Thread-safe.
void log_what_grpc_says(Log& log);

}  // namespace warmfront::server

// SPDX-License-Identifier: Apache-2.0
// Connection options, the same for every verb. Thread-safe.
#pragma once

#include <string>

#include "client/lib/client.h"

namespace CLI {
class App;
}

namespace warmfront::client {

/// --server, TLS and token options; and with --server, the environment's TRACEPARENT, a parsing error where
/// it is none. The references must outlive the parsing.
void add_server_options(CLI::App& app, std::string& address, ClientOptions& connection,
                        const std::string& server_help, bool required);

}  // namespace warmfront::client

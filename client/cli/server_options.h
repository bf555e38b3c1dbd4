// SPDX-License-Identifier: Apache-2.0
// The options that say how to reach a daemon, the same for every verb. Thread-safe.
#pragma once

#include <string>

#include "client/lib/client.h"

namespace CLI {
class App;
}

namespace warmfront::client {

/// --server, and who the daemon and the caller are. The references outlive the parsing.
void add_server_options(CLI::App& app, std::string& address, ClientSecurity& security,
                        const std::string& server_help, bool required);

}  // namespace warmfront::client

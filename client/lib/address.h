// SPDX-License-Identifier: Apache-2.0
// What a daemon's address looks like. Pure function.
#pragma once

#include <string_view>

namespace warmfront::client {

inline constexpr const char* kAddressExpected =
    "HOST:PORT (an IPv6 host in brackets) or unix:PATH is expected, the port in [1, 65535]";

/// Whether it has the form of one: gRPC takes what has no port for a web server's, and waits for it.
bool is_server_address(std::string_view text);

}  // namespace warmfront::client

// SPDX-License-Identifier: Apache-2.0
// Syntax of a daemon's address. Pure function.
#pragma once

#include <string_view>

namespace warmfront::client {

inline constexpr const char* kAddressExpected =
    "HOST:PORT (an IPv6 host in brackets) or unix:PATH is expected, the port in [1, 65535]";

/// Whether `text` is a valid address: gRPC reads an address without a port as a web server's, and waits for
/// it.
bool is_server_address(std::string_view text);

}  // namespace warmfront::client

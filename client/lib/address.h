// SPDX-License-Identifier: Apache-2.0
// A daemon's address. Thread-safe.
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace warmfront::client {

inline constexpr const char* kAddressExpected =
    "HOST:PORT (an IPv6 host in brackets) or unix:PATH is expected, the port in [1, 65535], "
    "the path of 107 bytes at most";

/// Whether `text` is a valid address: gRPC reads an address without a port as a web server's, and waits for
/// it.
bool is_server_address(std::string_view text);

/// The folder of a Unix socket's path where it does not exist: no daemon will listen there, and nobody should
/// wait for one.
std::optional<std::string> missing_folder(std::string_view address);

}  // namespace warmfront::client

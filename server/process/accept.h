// SPDX-License-Identifier: Apache-2.0
// Accepting connections when the process has no files left. Thread-safe.
#pragma once

#include <cstdint>

namespace warmfront::server {

/// Sets a file aside, so that connections can be refused when no other is left. gRPC 1.51 stops listening for
/// good when accept4() fails for want of files (CVE-2023-4785); linking this in puts an accept4() before the
/// C library's that closes such connections at once and goes on. Call it before a server is started; any
/// number of times.
void refuse_connections_without_files();

/// How many connections were closed for want of files since the process began.
std::uint64_t connections_without_files();

/// Another thread may open the file that is given up for a moment to refuse with: then connections wait that
/// nobody hears of. Refuses them as soon as a file is free, and sets one aside again. To be called every
/// second or so; costs a look at a flag.
void refuse_connections_left_waiting();

}  // namespace warmfront::server

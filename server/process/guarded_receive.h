// SPDX-License-Identifier: Apache-2.0
// The guard (http2_guard.h) between gRPC's connections and gRPC. Linking this in puts a recvmsg() and a close()
// before the C library's and an SSL_read() before OpenSSL's, which do as those do until guarding is switched on.
// Thread-safe.
#pragma once

#include <sys/socket.h>

#include <array>
#include <cstddef>
#include <cstdint>

#include "server/process/http2_guard.h"

namespace warmfront::server {

/// From now on every connection that accept4() accepts in this process is guarded: what it sends, plain or,
/// as a TLS server, decrypted. One whose client does what the guard forbids is ended as if the client had
/// closed it. An address has `most_per_address` connections at most, as peers.h says; 0: any number. To be
/// called once, before a server is started.
void guard_connections(const Http2Guard::Bounds& bounds, std::uint32_t most_per_address);

/// accept4() tells of each connection, and its client's address. False when that has too many, or when there
/// is no memory for a guard: close it.
[[nodiscard]] bool guard_connection(int connection, const sockaddr* address, socklen_t length) noexcept;

/// Connections refused since the start, since their address had as many as it may.
std::uint64_t connections_refused();

/// Connections ended since the start, by verdict.
std::array<std::uint64_t, Http2Guard::kVerdicts> connections_ended();

}  // namespace warmfront::server

// SPDX-License-Identifier: Apache-2.0
// Bytes told to the HTTP/2 guard in pieces, and calls as a client sends them.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include "server/process/http2_guard.h"
#include "tests/faults/raw_socket.h"

namespace warmfront::test::http2_pieces {

inline constexpr std::size_t kMetadataBytes = 16 << 10;
inline constexpr std::size_t kBlockBytes = 4 * kMetadataBytes + (16 << 10);

inline server::Http2Guard::Clock::time_point time_now;
inline server::Http2Guard::Clock::time_point standing_clock() {
  return time_now;
}

inline server::Http2Guard new_guard() {
  return server::Http2Guard({.max_metadata_bytes = kMetadataBytes}, &standing_clock);
}

inline std::span<const std::uint8_t> as_bytes(std::string_view bytes) {
  return {reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()};
}

/// In pieces whose sizes `next_size` returns.
template <class NextSize>
server::Http2Guard::Verdict told_in_pieces(std::string_view bytes, NextSize next_size) {
  server::Http2Guard guard = new_guard();
  while (!bytes.empty()) {
    const std::size_t size = std::min<std::size_t>(bytes.size(), next_size());
    if (guard.receive(as_bytes(bytes.substr(0, size))) != server::Http2Guard::kGood) break;
    bytes.remove_prefix(size);
  }
  return guard.verdict();
}

inline const std::string kPath = "/warmfront.v1.CollisionService/GetServerInfo";

inline std::string call(std::uint32_t stream, const http2::Headers& more = {}) {
  return http2::headers(stream, http2::call_headers(kPath, more));
}

}  // namespace warmfront::test::http2_pieces

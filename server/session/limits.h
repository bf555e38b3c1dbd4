// SPDX-License-Identifier: Apache-2.0
// What the daemon allows, with its defaults. Constant once the daemon runs.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>

namespace warmfront::server {

struct Limits {
  std::uint32_t max_sessions = 256;
  std::uint64_t max_vertices = 16'000'000;             ///< in a session
  std::uint64_t max_triangles = 16'000'000;            ///< in a session
  std::size_t max_contacts = 50'000'000;               ///< in an answer
  std::size_t max_front_bytes = std::size_t{4} << 30;  ///< in a session
  std::uint32_t window = 4;                            ///< frames of a session accepted and not yet answered
  std::size_t answer_chunk_bytes = std::size_t{1} << 20;
  std::size_t max_message_bytes = std::size_t{32} << 20;
  std::chrono::milliseconds idle_timeout = std::chrono::minutes(30);  ///< of a session without a stream
};

}  // namespace warmfront::server

// SPDX-License-Identifier: Apache-2.0
// What the daemon allows, with its defaults. Constant once the daemon runs.
#pragma once

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "server/session/usable_memory.h"

namespace warmfront::server {

struct Limits {
  std::uint32_t max_sessions = 256;
  std::uint32_t max_sessions_per_principal = 0;        ///< see default_quota() for 0, here and below
  std::uint64_t max_vertices = 16'000'000;             ///< in a session
  std::uint64_t max_triangles = 16'000'000;            ///< in a session
  std::size_t max_contacts = 50'000'000;               ///< in an answer
  std::size_t max_front_bytes = std::size_t{4} << 30;  ///< in a session
  /// Held for a session, everything counted; at most max_total_bytes (fit_to_memory()).
  std::size_t max_session_bytes = std::min(std::size_t{8} << 30, usable_memory_bytes() / 4 * 3);
  std::size_t max_total_bytes = usable_memory_bytes() / 4 * 3;  ///< held for all sessions
  std::size_t max_principal_bytes = 0;                          ///< held for all sessions of a principal
  std::uint32_t max_streams_per_connection = 128;               ///< calls at once
  std::uint32_t max_open_streams = 1024;                        ///< StreamSteps calls in the daemon
  std::uint32_t max_frames_in_flight = 4096;  ///< accepted in the daemon and not yet computed
  std::uint32_t max_streams_per_principal = 0;
  std::uint32_t max_frames_per_principal = 0;
  std::uint32_t max_uploads_per_principal = 0;  ///< CreateSession calls at once
  std::uint32_t window = 4;                     ///< frames of a session accepted and not yet answered
  std::size_t max_queued_bytes = std::size_t{256} << 20;  ///< answers of a stream, above which it is not read
  std::size_t answer_chunk_bytes = std::size_t{1} << 20;
  std::size_t max_message_bytes = std::size_t{32} << 20;
  std::uint32_t self_check_steps = 1000;  ///< of a session, from one self-check to the next; 0: none
  std::chrono::milliseconds idle_timeout = std::chrono::minutes(30);  ///< of a session without a stream
  std::chrono::milliseconds upload_timeout =
      std::chrono::minutes(5);  ///< of a scene, a frame's parts, an attach
  std::chrono::milliseconds write_stall_timeout = std::chrono::minutes(1);  ///< of one message of an answer
};

/// Lowers max_session_bytes to what all sessions together may hold, and to `usable`, the memory that there
/// is: a session that may hold more would be ended by the system, and all others with it, before it met its
/// limit. What was lowered, and what exceeds `usable` and is left as it is, in words for the log.
std::vector<std::string> fit_to_memory(Limits& limits, std::size_t usable = usable_memory_bytes());

}  // namespace warmfront::server

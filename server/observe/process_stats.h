// SPDX-License-Identifier: Apache-2.0
// What the operating system says of this process. Thread-safe.
#pragma once

#include <cstdint>

namespace warmfront::server {

struct ProcessStats {
  double cpu_seconds = 0;         ///< user and system
  double start_time_seconds = 0;  ///< since the epoch
  std::uint64_t resident_bytes = 0;
  std::uint64_t virtual_bytes = 0;
  std::uint64_t threads = 0;
  std::uint64_t open_files = 0;
  std::uint64_t max_files = 0;  ///< the soft limit
};

/// From Linux' /proc; what cannot be read is 0.
ProcessStats process_stats();

}  // namespace warmfront::server

// SPDX-License-Identifier: Apache-2.0
// Memory that was freed goes back to the system. glibc alone gives back only what is free at the very end of
// an arena: one small allocation above a hundred freed MiB keeps them all (malloc_trim(3), Notes).
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>

namespace warmfront::server {

/// Bounds what the end of each of glibc's arenas may keep: malloc_trim(3) gives that back for the main arena
/// alone, and by itself the bound grows up to 64 MiB an arena, several of them a core. To be called before
/// any thread is started.
void bound_free_memory();

/// In bytes.
struct MemoryUse {
  std::size_t resident = 0;   ///< of this process, in RAM
  std::size_t allocated = 0;  ///< what the allocator has handed out
  std::size_t free = 0;       ///< what it keeps, in RAM or given back
};

/// From Linux' /proc and mallinfo2(3); nothing where either is missing. Thread-safe.
std::optional<MemoryUse> memory_use();

/// Decides when freed memory is worth giving back. Not thread-safe: for one ticker.
class FreeMemory {
 public:
  /// What may stay with the allocator: for the next message, frame or session.
  static constexpr std::size_t kLeast = std::size_t{16} << 20;

  /// True when more than kLeast, and more than a quarter of what is allocated, is free and in RAM, now and
  /// when last asked: what steps and messages free and need again at once stays.
  bool due(const MemoryUse& use);

  /// What remains in RAM beside what is allocated is code, stacks and pieces of pages; what was freed
  /// meanwhile is none of it.
  void given_back(const MemoryUse& before, const MemoryUse& left);

 private:
  bool seen_ = false;
  std::int64_t rest_ = 0;  // resident and not allocated when memory was last given back
};

/// Asks `free_memory` about the process as it is, and gives back what is due. To be called every second or
/// so: threads that allocate wait a little meanwhile. The bytes that left RAM.
std::size_t give_back_free_memory(FreeMemory& free_memory);

}  // namespace warmfront::server

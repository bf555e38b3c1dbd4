// SPDX-License-Identifier: Apache-2.0
// Asking the allocator. Thread safety as stated in the header.
#include "server/process/free_memory.h"

#include <malloc.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>

namespace warmfront::server {
namespace {

std::int64_t signed_size(std::size_t bytes) {
  return static_cast<std::int64_t>(bytes);
}

}  // namespace

void bound_free_memory() {
#ifdef __GLIBC__
  // Messages of up to 8 MiB come and go without a page fault. To set either threshold fixes the other as it
  // is, too low for us: arrays below 32 MiB, glibc's own limit, are served by the arenas.
  mallopt(M_MMAP_THRESHOLD, 32 << 20);
  mallopt(M_TRIM_THRESHOLD, 8 << 20);
#endif
}

std::optional<MemoryUse> memory_use() {
#ifdef __GLIBC__
  std::ifstream file("/proc/self/statm");
  std::size_t pages = 0, resident_pages = 0;
  if (!(file >> pages >> resident_pages)) return std::nullopt;
  const struct mallinfo2 info = mallinfo2();
  return MemoryUse{resident_pages * static_cast<std::size_t>(getpagesize()), info.uordblks + info.hblkhd,
                   info.fordblks};
#else
  return std::nullopt;
#endif
}

bool FreeMemory::due(const MemoryUse& use) {
  const std::size_t kept = std::max(kLeast, use.allocated / 4);
  // What was given back still counts as free; what other allocators hold, as resident.
  const bool much = use.free > kept && signed_size(use.resident) > signed_size(use.allocated + kept) + rest_;
  const bool again = much && seen_;
  seen_ = much;
  return again;
}

void FreeMemory::given_back(const MemoryUse& before, const MemoryUse& left) {
  seen_ = false;
  rest_ = signed_size(left.resident) - signed_size(std::max(before.allocated, left.allocated));
}

std::size_t give_back_free_memory(FreeMemory& free_memory) {
#ifdef __GLIBC__
  const std::optional<MemoryUse> before = memory_use();
  if (!before || !free_memory.due(*before)) return 0;
  malloc_trim(0);
  const std::optional<MemoryUse> after = memory_use();
  if (!after) return 0;
  free_memory.given_back(*before, *after);
  return before->resident > after->resident ? before->resident - after->resident : 0;
#else
  static_cast<void>(free_memory);
  return 0;
#endif
}

}  // namespace warmfront::server

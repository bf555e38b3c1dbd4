// SPDX-License-Identifier: Apache-2.0
#include "engine/parallel/large_pages.h"

#include <sys/mman.h>

#include <cerrno>
#include <cstdint>

namespace warmfront {

void prefer_large_pages(void* begin, std::size_t bytes) noexcept {
  constexpr std::uintptr_t kPage = std::uintptr_t{1} << 21;
  const auto from = reinterpret_cast<std::uintptr_t>(begin);
  const std::uintptr_t first = (from + kPage - 1) / kPage * kPage;
  const std::uintptr_t end = (from + bytes) / kPage * kPage;
  if (first >= end) return;
  const int before = errno;
  static_cast<void>(::madvise(reinterpret_cast<void*>(first), end - first, MADV_HUGEPAGE));
  errno = before;
}

}  // namespace warmfront

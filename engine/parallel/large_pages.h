// SPDX-License-Identifier: Apache-2.0
// Fresh memory in large pages. Thread-safe.
#pragma once

#include <cstddef>

namespace warmfront {

/// Asks the system to map memory that nothing was written to yet in pages of 2 MiB, as far as it has whole
/// ones: a fault for 512 pages, each of which costs a third of a microsecond or more. A hint, for systems
/// that map so where they are asked (Linux, transparent_hugepage/enabled: madvise); nothing depends on it.
void prefer_large_pages(void* begin, std::size_t bytes) noexcept;

}  // namespace warmfront

// SPDX-License-Identifier: Apache-2.0
// Makes the n-th allocation fail. For programs that list failing_allocations.cpp among their own sources: its
// operator new then is the program's. Counts the allocations of all threads; only one may be alive at a time.
#pragma once

#include <cstddef>
#include <cstdint>

namespace warmfront::testing {

class FailingAllocations {
 public:
  enum class Which : std::uint8_t {
    kOne,          ///< only the n-th
    kAllFromThere  ///< and all later ones
  };
  /// Counts from now on, from 0; with n < 0 none fails.
  explicit FailingAllocations(long n, Which which = Which::kOne);
  ~FailingAllocations();
  FailingAllocations(const FailingAllocations&) = delete;
  FailingAllocations& operator=(const FailingAllocations&) = delete;

  /// Was there an n-th allocation?
  static bool met();
};

/// Bytes allocated by operator new and not yet freed.
std::size_t live_bytes();
/// Peak of live_bytes() since forget_most_live_bytes().
std::size_t most_live_bytes();
void forget_most_live_bytes();

}  // namespace warmfront::testing

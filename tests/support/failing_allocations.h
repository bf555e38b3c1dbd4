// SPDX-License-Identifier: Apache-2.0
// Lets the n-th allocation fail. For programs that list failing_allocations.cpp among their own sources: its
// operator new then is the program's. Counts those of all threads; one at a time may be alive.
#pragma once

#include <cstddef>
#include <cstdint>

namespace warmfront::testing {

class FailingAllocations {
 public:
  enum class Which : std::uint8_t {
    kOne,          ///< the n-th alone
    kAllFromThere  ///< and every one after it
  };
  /// Of those from now on, counted from 0; with n < 0 none fails.
  explicit FailingAllocations(long n, Which which = Which::kOne);
  ~FailingAllocations();
  FailingAllocations(const FailingAllocations&) = delete;
  FailingAllocations& operator=(const FailingAllocations&) = delete;

  /// Was there an n-th allocation?
  static bool met();
};

/// Bytes that operator new has given and that were not returned.
std::size_t live_bytes();
/// The most of these at a time since forget_most_live_bytes().
std::size_t most_live_bytes();
void forget_most_live_bytes();

}  // namespace warmfront::testing

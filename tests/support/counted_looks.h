// SPDX-License-Identifier: Apache-2.0
// Cancels a step at the n-th look at its flag. For programs that list counted_looks.cpp among their own
// sources: its StopSignal::look() then replaces the engine's. One step at a time.
#pragma once

#include <atomic>

namespace warmfront::testing {

class CountedLooks {
 public:
  /// The n-th look from now on, counted from 0, and all later ones find the flag set; with n < 0 none does.
  explicit CountedLooks(long n);
  ~CountedLooks();
  CountedLooks(const CountedLooks&) = delete;
  CountedLooks& operator=(const CountedLooks&) = delete;

  /// The flag to pass to the call to be cancelled.
  static const std::atomic<bool>* flag();
  /// Was there an n-th look?
  static bool met();
  /// Number of looks at the flag since construction.
  static long count();
};

}  // namespace warmfront::testing

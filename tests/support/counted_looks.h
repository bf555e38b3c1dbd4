// SPDX-License-Identifier: Apache-2.0
// Cancels a step at the n-th look at its flag. For programs that list counted_looks.cpp among their own
// sources: its StopSignal::look() then takes the engine's place. One step at a time.
#pragma once

#include <atomic>

namespace warmfront::testing {

class CountedLooks {
 public:
  /// The n-th look from now on, counted from 0, and all after it find the flag set; with n < 0 none does.
  explicit CountedLooks(long n);
  ~CountedLooks();
  CountedLooks(const CountedLooks&) = delete;
  CountedLooks& operator=(const CountedLooks&) = delete;

  /// To be given to what is to be cancelled.
  static const std::atomic<bool>* flag();
  /// Was there an n-th look?
  static bool met();
  /// The looks at the flag since this was made.
  static long count();
};

}  // namespace warmfront::testing

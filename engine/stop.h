// SPDX-License-Identifier: Apache-2.0
// Stopping a step from outside. Thread-safe.
#pragma once

#include <atomic>

namespace warmfront {

/// Thrown by what was told to stop; the collider answers it with kCancelled.
struct Stopped {};

/// Asks a flag of the caller's, between two grains of work.
class StopSignal {
 public:
  StopSignal() = default;
  explicit StopSignal(const std::atomic<bool>* flag) : flag_(flag) {}

  /// Throws Stopped when the flag is set.
  void check() const {
    if (flag_ != nullptr) look();
  }

  const std::atomic<bool>* flag() const { return flag_; }

 private:
  // Alone in its source file, so that a test program may link another in its place, which stops at the n-th
  // look: tests/support/counted_looks.h.
  void look() const;

  const std::atomic<bool>* flag_ = nullptr;
};

}  // namespace warmfront

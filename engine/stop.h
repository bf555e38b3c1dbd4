// SPDX-License-Identifier: Apache-2.0
// Stopping a step from outside. Thread-safe.
#pragma once

#include <atomic>
#include <cstdint>

namespace warmfront {

/// Thrown when told to stop; the collider turns it into kCancelled.
struct Stopped {};

/// Checks a caller's flag between two grains of work.
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
  // Defined alone in its source file, so that a test program may link a replacement that stops at the n-th
  // look: tests/support/counted_looks.h.
  void look() const;

  const std::atomic<bool>* flag_ = nullptr;
};

/// Checks the flag once per several units of work, for loops whose iterations take a few nanoseconds. Used by
/// one thread at a time.
class PacedStop {
 public:
  explicit PacedStop(StopSignal stop, std::uint32_t every = kEvery) : stop_(stop), every_(every) {}

  /// Counts a unit of work. Throws Stopped when the flag is set and a look is due.
  void check() {
    if (++units_ < every_) return;
    units_ = 0;
    stop_.check();
  }

  static constexpr std::uint32_t kEvery = 4096;

 private:
  StopSignal stop_;
  std::uint32_t every_;
  std::uint32_t units_ = 0;
};

}  // namespace warmfront

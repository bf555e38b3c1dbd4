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

  void check() const {
    if (flag_ != nullptr && flag_->load(std::memory_order_relaxed)) throw Stopped{};
  }

  const std::atomic<bool>* flag() const { return flag_; }

 private:
  const std::atomic<bool>* flag_ = nullptr;
};

}  // namespace warmfront

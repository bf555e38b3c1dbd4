// SPDX-License-Identifier: Apache-2.0
// The memory of a frame that is done, for the next one. What glibc has no room for at the end of an arena comes from
// the system anew each time, page by page, which takes longer than to copy positions there. Thread-safe.
#pragma once

#include <cstddef>
#include <memory>
#include <utility>

#include "server/annotations.h"
#include "server/session/account.h"
#include "server/session/position_buffer.h"

namespace warmfront::server {

class SparePositions {
 public:
  /// What is kept is charged to the account.
  explicit SparePositions(std::shared_ptr<Account> account) : held_(std::move(account)) {}

  /// One is kept, the largest; what is small never.
  void keep(PositionMemory memory) noexcept {
    if (memory.bytes() < kLeast) return;
    const MutexLock lock(mutex_);
    if (memory.bytes() <= memory_.bytes()) return;
    held_.set(memory.bytes());
    std::swap(memory_, memory);
  }
  /// What is kept, or nothing.
  PositionMemory take() noexcept {
    const MutexLock lock(mutex_);
    held_.set(0);
    return std::exchange(memory_, {});
  }

 private:
  static constexpr std::size_t kLeast = std::size_t{256} << 10;

  Mutex mutex_;
  PositionMemory memory_ WARMFRONT_GUARDED_BY(mutex_);
  Holding held_ WARMFRONT_GUARDED_BY(mutex_);
};

}  // namespace warmfront::server

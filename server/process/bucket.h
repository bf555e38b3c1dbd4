// SPDX-License-Identifier: Apache-2.0
// What may happen so often at once and so often a second (a token bucket). Used by one thread at a time.
#pragma once

#include <algorithm>
#include <chrono>
#include <cstdint>

namespace warmfront::server {

class Bucket {
 public:
  using Clock = std::chrono::steady_clock;
  using Now = Clock::time_point (*)();

  Bucket(std::uint32_t burst, std::uint32_t per_second, Clock::time_point now)
      : burst_(burst), per_second_(per_second), left_(burst), filled_(now) {}

  /// Whether `count` of them may happen now. The clock is asked when there is nothing left only.
  bool take(std::uint32_t count, Now now) {
    if (left_ < count) fill(now());
    if (left_ < count) return false;
    left_ -= count;
    return true;
  }
  /// Whether as many may happen by now as at first.
  bool full(Clock::time_point now) const { return left_ >= burst_ || left_ + more(now) >= burst_; }

 private:
  std::uint32_t more(Clock::time_point now) const {
    const auto passed = std::chrono::duration_cast<std::chrono::milliseconds>(now - filled_).count();
    return static_cast<std::uint32_t>(std::min<std::uint64_t>(
        burst_, static_cast<std::uint64_t>(std::max<std::int64_t>(passed, 0)) * per_second_ / 1000));
  }
  void fill(Clock::time_point now) {
    const std::uint32_t more = this->more(now);
    if (more > 0) filled_ = now;
    left_ += more;
  }

  std::uint32_t burst_, per_second_, left_;
  Clock::time_point filled_;
};

}  // namespace warmfront::server

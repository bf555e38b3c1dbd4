// SPDX-License-Identifier: Apache-2.0
// How a frame is called in messages, and what it cost in time. Thread-safe.
#pragma once

#include <chrono>
#include <cstdint>
#include <string>

namespace warmfront::client {

inline std::string frame_name(std::uint64_t frame) {
  return "frame " + std::to_string(frame);
}

/// Measures a piece of work from where it is made.
class Stopwatch {
 public:
  double milliseconds() const {
    return std::chrono::duration<double, std::milli>(Clock::now() - start_).count();
  }

 private:
  using Clock = std::chrono::steady_clock;
  Clock::time_point start_ = Clock::now();
};

}  // namespace warmfront::client

// SPDX-License-Identifier: Apache-2.0
// Does a thing again and again on a thread of its own. Thread-safe.
#pragma once

#include <chrono>
#include <condition_variable>
#include <functional>
#include <mutex>
#include <thread>

namespace warmfront::server {

class Ticker {
 public:
  /// Calls `tick`, which throws nothing but std::bad_alloc (the next tick comes then), every `period` until
  /// the ticker is destroyed, which waits for a tick under way.
  Ticker(std::chrono::milliseconds period, std::function<void()> tick);

 private:
  void work(const std::stop_token& stop);

  // Constant after construction.
  const std::chrono::milliseconds period_;
  const std::function<void()> tick_;

  std::mutex mutex_;  // of the wait only; protects nothing
  std::condition_variable_any wake_;
  std::jthread thread_;  // last: it uses all of the above
};

}  // namespace warmfront::server

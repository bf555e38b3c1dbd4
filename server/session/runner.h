// SPDX-License-Identifier: Apache-2.0
// The threads on which sessions do their work, so that the engine never runs in a gRPC reaction. Thread-safe.
#pragma once

#include <condition_variable>
#include <deque>
#include <functional>
#include <mutex>
#include <thread>
#include <vector>

namespace warmfront::server {

/// Runs tasks first come, first served. Tasks do not throw. They share the arena of Workers for their inner
/// loops, so a few threads here are enough: one more runs one more step at a time, not one more core.
class Runner {
 public:
  /// `threads` >= 1.
  explicit Runner(int threads);
  /// Runs what was posted, then joins.
  ~Runner();
  Runner(const Runner&) = delete;
  Runner& operator=(const Runner&) = delete;

  void post(std::function<void()> task);

 private:
  void work();

  // Protected by mutex_.
  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<std::function<void()>> tasks_;
  bool stopping_ = false;

  // Constant after construction.
  std::vector<std::thread> threads_;
};

}  // namespace warmfront::server

// SPDX-License-Identifier: Apache-2.0
// The threads on which sessions do their work, so that the engine never runs in a gRPC reaction. Thread-safe.
#pragma once

#include <array>
#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <functional>
#include <thread>
#include <vector>

#include "server/annotations.h"

namespace warmfront::server {

/// How long a task will take its thread.
enum class Lane : std::uint8_t {
  kShort,  ///< milliseconds
  kLong,
};

/// Runs tasks first come, first served within their lane, each lane on threads of its own, so that a short
/// task never waits for long ones. Tasks do not throw. They share the arena of Workers for their inner loops,
/// so a few threads here are enough: one more runs one more step at a time, not one more core.
class Runner {
 public:
  /// `threads` >= 1, for each lane.
  explicit Runner(int threads);
  /// Runs what was posted, then joins.
  ~Runner();
  Runner(const Runner&) = delete;
  Runner& operator=(const Runner&) = delete;

  void post(std::function<void()> task, Lane lane = Lane::kLong);
  /// Tasks being run now, in either lane.
  int busy() const { return busy_.load(std::memory_order_relaxed); }

 private:
  struct Queue {
    std::condition_variable changed;
    std::deque<std::function<void()>> tasks;
  };
  void work(Queue& own);
  static std::function<void()> take(Queue& queue);

  // Protected by mutex_.
  Mutex mutex_;
  std::array<Queue, 2> queues_;  // by lane; of them, the tasks
  bool stopping_ WARMFRONT_GUARDED_BY(mutex_) = false;

  std::atomic<int> busy_{0};

  // Constant after construction.
  std::vector<std::thread> threads_;
};

}  // namespace warmfront::server

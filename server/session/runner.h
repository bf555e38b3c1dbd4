// SPDX-License-Identifier: Apache-2.0
// The threads on which sessions do their work, so that no gRPC reaction waits for the engine longer than for
// a brief turn. Thread-safe.
#pragma once

#include <array>
#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <list>
#include <optional>
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
  /// `threads` >= 1, for each lane. At most `guests` tasks run on threads of others at a time.
  explicit Runner(int threads, int guests = 0);
  /// Runs what was posted, then joins.
  ~Runner();
  Runner(const Runner&) = delete;
  Runner& operator=(const Runner&) = delete;

  /// Says whether it is to be run once more, behind what waits in a lane by then.
  using Task = std::function<std::optional<Lane>()>;
  /// Tasks, each with the memory that it takes to queue it: to make them may throw, to post them does not.
  using Tasks = std::list<Task>;

  void post(std::function<void()> task, Lane lane = Lane::kLong);
  void post(Tasks tasks, Lane lane) noexcept;
  /// Runs one task on the calling thread, and posts it when it is to be run once more; unless others of its
  /// lane wait or too many guests are here: then it does nothing and returns false. A task that throws ends
  /// the process, as on the threads of this: the caller's thread may be one that swallows it, and what the
  /// task had taken would never come back.
  [[nodiscard]] bool run_here(Tasks& one, Lane lane) noexcept;
  /// Whether more short tasks wait than there are threads for them: each has its next one already.
  bool backlog() const { return waiting_short_.load(std::memory_order_relaxed) > lane_threads_; }
  /// Tasks being run now, in either lane or by guests.
  int busy() const { return busy_.load(std::memory_order_relaxed); }
  /// Tasks that have ended.
  std::uint64_t done() const { return done_.load(std::memory_order_relaxed); }
  /// Whether a task of this lane, which is being run, takes one thread of Workers: a short one, beside
  /// others. It would wait for as many as a long one holds.
  bool takes_one_thread(Lane lane) const { return lane == Lane::kShort && busy() > 1; }

 private:
  struct Queue {
    std::condition_variable changed;
    Tasks tasks;
  };
  void work(Queue& own);
  Tasks take(Queue& queue);
  /// Runs it, and posts it again when it says so.
  void run(Tasks one) noexcept;
  std::size_t short_tasks() const { return queues_[static_cast<std::size_t>(Lane::kShort)].tasks.size(); }

  // Protected by mutex_.
  Mutex mutex_;
  std::array<Queue, 2> queues_;  // by lane; of them, the tasks
  bool stopping_ WARMFRONT_GUARDED_BY(mutex_) = false;

  int guests_ WARMFRONT_GUARDED_BY(mutex_) = 0;

  std::atomic<int> busy_{0};
  std::atomic<std::uint64_t> done_{0};
  std::atomic<std::size_t> waiting_short_{0};  // short_tasks(), to be read without the lock

  // Constant after construction.
  const std::size_t lane_threads_;
  const int most_guests_;
  std::vector<std::thread> threads_;
};

}  // namespace warmfront::server

// SPDX-License-Identifier: Apache-2.0
// Threads that take one thing after another, and one in reserve. Thread-safe.
#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <functional>
#include <limits>
#include <thread>
#include <utility>
#include <vector>

#include "server/annotations.h"

namespace warmfront::server {

/// As many as there are cores may all compute, and nothing is handed on that a free core could have taken.
/// That a step takes much longer than was foreseen must not keep others waiting: while all of them have been
/// at work for long, the one in reserve takes what comes, and hands it on.
class ReserveThreads {
 public:
  using Clock = std::chrono::steady_clock;

  /// One thread's: how long it has been at work.
  class Hand {
   public:
    void begins() noexcept {
      since_.store(Clock::now().time_since_epoch().count(), std::memory_order_relaxed);
    }
    void ends() noexcept { since_.store(kFree, std::memory_order_relaxed); }

   private:
    friend class ReserveThreads;
    static constexpr Clock::rep kFree = std::numeric_limits<Clock::rep>::max();
    std::atomic<Clock::rep> since_{kFree};
  };

  /// Waits for something, at most so long, and does it, which it tells `hand`. False: there is an end to it.
  using Turn = std::function<bool(Hand& hand, std::chrono::milliseconds most)>;

  /// `threads` >= 1 beside the reserve. Nothing is done before begin().
  ReserveThreads(int threads, Turn turn)
      : hands_(static_cast<std::size_t>(threads)), turn_(std::move(turn)) {}
  ~ReserveThreads() { join(); }
  ReserveThreads(const ReserveThreads&) = delete;
  ReserveThreads& operator=(const ReserveThreads&) = delete;

  void begin();
  /// For when turns come to an end: returns after the last. Once, or again.
  void join() noexcept;

  /// All others have been at work for so long: the reserve joins in.
  static constexpr std::chrono::milliseconds kLong{10};

 private:
  void stand_by() noexcept;
  /// How many of the threads have been at work for at least so long.
  std::size_t at_work_for(std::chrono::milliseconds least) const noexcept;

  std::vector<Hand> hands_;
  const Turn turn_;
  Mutex mutex_;
  std::condition_variable ended_;
  bool ends_ WARMFRONT_GUARDED_BY(mutex_) = false;
  std::vector<std::thread> threads_;
};

}  // namespace warmfront::server

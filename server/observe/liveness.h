// SPDX-License-Identifier: Apache-2.0
// Whether the daemon lives, which is not whether it is busy. Thread-safe.
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>

namespace warmfront::server {

/// A daemon lives while its beat comes, which goes through all its calls and their locks, and while the steps
/// that it has begun end, or take processor time: a tenant that is greedy is none that hangs.
class Liveness {
 public:
  /// Work that the daemon does, as it is now.
  struct Work {
    std::uint64_t tasks_done = 0;
    bool running = false;                        ///< tasks are under way
    std::chrono::nanoseconds processor_time{0};  ///< of all threads so far
  };

  /// To be called every second or so, by one thread at a time; sooner calls are passed over. Of a process
  /// that was stopped and goes on only the beats count, not the time.
  void beat(const Work& work, std::chrono::steady_clock::time_point now);
  /// False without a beat for 20 s, or after 60 beats with tasks under way of which none ended, and next to
  /// no processor time taken.
  bool alive(std::chrono::steady_clock::time_point now) const;

  /// Of this process.
  static std::chrono::nanoseconds processor_time();

 private:
  using Clock = std::chrono::steady_clock;
  std::atomic<Clock::rep> last_beat_{Clock::now().time_since_epoch().count()};
  std::atomic<int> beats_without_progress_{0};
  Work last_;  // of beat()
};

}  // namespace warmfront::server

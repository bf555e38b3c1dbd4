// SPDX-License-Identifier: Apache-2.0
// Whose tasks those of a runner are, and how much of the machine each of these may have. Thread-safe.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <functional>
#include <list>
#include <memory>
#include <optional>
#include <utility>

namespace warmfront::server {

/// How long a task will take its thread.
enum class Lane : std::uint8_t {
  kShort,  ///< milliseconds
  kLong,
};

class Share;

/// What a runner runs. It says whether it is to be run once more, behind what waits in a lane by then.
struct Task {
  template <class Work>
  Task(Work the_work, std::shared_ptr<Share> the_share = {})  // NOLINT: implicit by design
      : work(std::move(the_work)), share(std::move(the_share)) {}
  std::function<std::optional<Lane>()> work;
  std::shared_ptr<Share> share;  ///< null: the runner's own
};
/// Tasks, each with the memory that it takes to queue it: to make them may throw, to post them does not.
using Tasks = std::list<Task>;

/// One for whom tasks are run. Of those whose tasks wait, the one comes first whose tasks have taken the
/// least time by its weight (fair queueing: Demers, Keshav and Shenker 1989); its own are first come, first
/// served. Who was away has no claim on the time that it did not take.
class Share {
 public:
  explicit Share(std::uint32_t weight = 1) : weight_(weight) {}
  Share(const Share&) = delete;
  Share& operator=(const Share&) = delete;

  /// >= 1; counts from the next task on.
  void set_weight(std::uint32_t weight) { weight_.store(weight, std::memory_order_relaxed); }
  std::uint32_t weight() const { return weight_.load(std::memory_order_relaxed); }

 private:
  friend class Runner;
  struct Queue {
    Tasks tasks;
    std::list<Share*> place;  ///< in the list of those that wait; here while none does, so that it needs none
  };
  double ms_by_weight(double ms) const { return ms / static_cast<double>(weight()); }
  /// Up to now, tasks under way included; in milliseconds by weight.
  double had(double now_ms) const { return had_ms_ + ms_by_weight(running_ * now_ms - begun_ms_); }
  void begin(double now_ms) {
    ++running_;
    begun_ms_ += now_ms;
  }
  void end(double began_ms, double now_ms) {
    --running_;
    begun_ms_ -= began_ms;
    had_ms_ += ms_by_weight(now_ms - began_ms);
  }

  std::atomic<std::uint32_t> weight_;

  // Protected by the runner's mutex.
  std::array<Queue, 2> queues_{Queue{{}, {this}}, Queue{{}, {this}}};  // by lane
  double had_ms_ = 0;    // of tasks that have ended, by weight
  int running_ = 0;      // tasks under way,
  double begun_ms_ = 0;  // and the sum of when they began
};

}  // namespace warmfront::server

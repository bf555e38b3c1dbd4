// SPDX-License-Identifier: Apache-2.0
// A session's queue: its jobs, which do not throw, run one at a time, in order, on the runner's threads, or
// on the thread that hands over a brief one. Thread-safe.
#pragma once

#include <atomic>
#include <cstddef>
#include <functional>
#include <limits>
#include <list>
#include <memory>
#include <optional>
#include <utility>

#include "server/annotations.h"
#include "server/session/runner.h"
#include "server/session/step_cost.h"

namespace warmfront::server {

/// A turn is one job, or steps that wait and are brief together: the second frame of a session finds its
/// hierarchy where the first left it, in the core's cache. After a turn the mailbox goes to the back of the
/// runner's queue, so that a busy session does not starve others.
class Mailbox : public std::enable_shared_from_this<Mailbox> {
 public:
  using Job = std::function<void()>;
  enum class Kind {
    kStep,   ///< takes as long as is foreseen
    kOther,  ///< has a turn of its own
  };

  /// Holds at most `capacity` jobs that have not begun. `runner` outlives the mailbox; `share` is whose the
  /// jobs are, null the runner's own.
  Mailbox(Runner& runner, std::size_t capacity, Lane lane = Lane::kLong, std::shared_ptr<Share> share = {})
      : runner_(runner), share_(std::move(share)), capacity_(capacity), lane_(lane) {}

  struct Waiting {
    Job job;
    Kind kind;
  };
  /// A job with the memory that it takes to queue it: to make one may throw, to post it does not. So a job
  /// whose queueing failed was never begun, and one that is queued is run.
  struct Entry {
    std::list<Waiting> job;
    Runner::Tasks turn;  ///< dropped where the mailbox is scheduled already
  };
  Entry prepare(Job job, Kind kind = Kind::kOther);

  /// False, and nothing is queued, when the mailbox is full.
  [[nodiscard]] bool post(Job job, Kind kind = Kind::kOther);
  /// The same, but never refused: for jobs that something else bounds.
  void post_always(Entry entry) noexcept;
  void post_always(Job job, Kind kind = Kind::kOther) { post_always(prepare(std::move(job), kind)); }
  /// Which steps a thread that hands one over may run itself.
  enum class Here : bool {
    kBrief,  ///< on a thread that has others to serve
    kShort,  ///< those of the short lane too, on one of which another remains
  };
  /// As post_always(), for a step; but where it may run here, none waits, and the runner has room for a guest,
  /// this thread runs it, and what else makes a turn, before it returns.
  void run_or_post(Entry step, Here here = Here::kBrief) noexcept;
  void run_or_post(Job step, Here here = Here::kBrief) {
    run_or_post(prepare(std::move(step), Kind::kStep), here);
  }

  /// Would a step run here with Here::kShort, as far as is foreseen, and is it more than brief?
  bool takes_a_short_step_here() const {
    const double ms = ms_.load(std::memory_order_relaxed);
    return ms != kUnforeseen && !is_brief(ms) && lane_.load(std::memory_order_relaxed) == Lane::kShort;
  }

  static constexpr double kUnforeseen = std::numeric_limits<double>::infinity();
  /// Where the next job runs, and how long a step will take one thread, in milliseconds.
  void foresee(Lane lane, double ms) {
    lane_.store(lane, std::memory_order_relaxed);
    ms_.store(ms, std::memory_order_relaxed);
  }

 private:
  /// Whether the mailbox must be scheduled, which the caller does without the lock.
  [[nodiscard]] bool push_locked(Entry& entry) noexcept WARMFRONT_REQUIRES(mutex_);
  /// How long the first job will take.
  double front_ms_locked() const WARMFRONT_REQUIRES(mutex_);
  /// Where the next turn is, if there is one.
  std::optional<Lane> run_turn() noexcept;

  // Constant after construction.
  Runner& runner_;
  const std::shared_ptr<Share> share_;
  const std::size_t capacity_;

  std::atomic<Lane> lane_;
  std::atomic<double> ms_{kUnforeseen};

  // Protected by mutex_.
  Mutex mutex_;
  std::list<Waiting> jobs_ WARMFRONT_GUARDED_BY(mutex_);
  bool scheduled_ WARMFRONT_GUARDED_BY(mutex_) = false;
};

}  // namespace warmfront::server

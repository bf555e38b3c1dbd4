// SPDX-License-Identifier: Apache-2.0
// The threads on which sessions do their work, so that no gRPC reaction waits for the engine longer than for
// a brief turn. Thread-safe.
#pragma once

#include <sys/types.h>

#include <array>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <list>
#include <memory>
#include <optional>
#include <thread>

#include "server/annotations.h"
#include "server/session/share.h"

namespace warmfront::server {

/// Threads of others on which tasks run.
enum class Guest : std::uint8_t {
  kReaction,  ///< gRPC's
  kPacket,    ///< that receive packets of clients on this machine
};
/// How many tasks may run on these at a time.
struct Guests {
  int reactions = 0;
  int packets = 0;
};

/// Runs tasks by their shares, and each share's first come, first served within their lane, each lane on
/// threads of its own, so that a short task never waits for long ones. Tasks do not throw. They share the
/// threads of Workers for their inner loops, so a few threads here are enough.
class Runner {
 public:
  /// How long a task may take its lane's thread; then another thread takes its place in the lane, and it goes
  /// on behind all others that the cores are wanted for, with what helps it.
  struct Overrun {
    std::array<std::chrono::milliseconds, 2> by_lane;
    int most = 32;  ///< threads beyond those of the lanes
  };

  /// Tells the time that tasks are charged by. Called from any thread.
  using Clock = std::function<std::chrono::steady_clock::time_point()>;

  /// `threads` >= 1, for each lane. Without `overrun` no task is relieved, and none gives way to others.
  explicit Runner(int threads, Guests guests = {}, std::optional<Overrun> overrun = std::nullopt,
                  Clock clock = std::chrono::steady_clock::now);
  /// Runs what was posted, then joins.
  ~Runner();
  Runner(const Runner&) = delete;
  Runner& operator=(const Runner&) = delete;

  using Tasks = server::Tasks;

  void post(std::function<void()> task, Lane lane = Lane::kLong, std::shared_ptr<Share> share = {});
  /// One task.
  void post(Tasks one, Lane lane) noexcept;
  /// Runs one task on the calling thread, and posts it when it is to be run once more; unless others of its
  /// lane wait or too many guests are here: then it does nothing and returns false. A task that throws ends
  /// the process, as on the threads of this: the caller's thread may be one that swallows it, and what the
  /// task had taken would never come back.
  /// On threads that receive packets one guest less has room where the task is not brief, or where others'
  /// shares have been about within a second: then the last thread queues what comes, by their shares.
  [[nodiscard]] bool run_here(Tasks& one, Lane lane, Guest guest = Guest::kReaction,
                              bool brief = true) noexcept;
  /// Whether more short tasks wait than there are threads for them: each has its next one already.
  bool backlog() const { return waiting_short_.load(std::memory_order_relaxed) > lane_threads_; }
  /// Tasks being run now, in either lane or by guests.
  int busy() const { return busy_.load(std::memory_order_relaxed); }
  /// Tasks that have ended.
  std::uint64_t done() const { return done_.load(std::memory_order_relaxed); }
  /// Whether a task of this lane, which is being run, takes one thread of Workers: a short one, beside
  /// others, to whom the other threads are worth more.
  bool takes_one_thread(Lane lane) const { return lane == Lane::kShort && busy() > 1; }

 private:
  struct Thread {
    Lane lane;
    std::thread thread;
    double began_ms = -1;   ///< of the task under way; < 0: none
    pid_t id = 0;           ///< by which the system knows it; 0: not yet
    bool relieved = false;  ///< another has its place: it ends with its task
    /// Others get the core once a millisecond, also from oneTBB's threads that help.
    std::shared_ptr<std::atomic<bool>> gives_way;
    bool ended = false;
  };
  struct Queue {
    std::condition_variable changed;
    std::list<Share*> waiting;  ///< those with tasks
    std::size_t tasks = 0;
  };

  double now_ms() const;
  Queue& queue_of(Lane lane) { return queues_[static_cast<std::size_t>(lane)]; }
  Share& share_of(const Task& task) const { return task.share ? *task.share : *own_; }

  void work(Thread& self);
  void watch();
  /// Puts threads in the place of those whose tasks take long. Whether it is to be asked again soon.
  bool relieve() WARMFRONT_REQUIRES(mutex_);
  /// While short tasks come and go, what computes for long lets them have a core, once a millisecond: to
  /// interrupt it, they would wait for a tick of the system's clock.
  void let_short_ones_through(double now) WARMFRONT_REQUIRES(mutex_);
  void short_begins() WARMFRONT_REQUIRES(mutex_);
  /// Whether it could be.
  bool relieve(Thread& thread) WARMFRONT_REQUIRES(mutex_);
  void start(Lane lane) WARMFRONT_REQUIRES(mutex_);
  void queue(Tasks& one, Lane lane) noexcept WARMFRONT_REQUIRES(mutex_);
  Tasks take(Lane lane) WARMFRONT_REQUIRES(mutex_);
  /// Runs it without the lock, counts its time, and queues it again when it says so. Called and left with the
  /// lock held, by another's hand: the analysis does not follow that.
  void run(Tasks one, UniqueLock& lock) noexcept WARMFRONT_REQUIRES(mutex_) WARMFRONT_UNCHECKED_LOCKING;
  /// Notes whose the task is, and says whether there is room for one more guest.
  bool has_room_for(const Share& share, Guest guest, bool brief) noexcept WARMFRONT_REQUIRES(mutex_);
  void count_waiting() WARMFRONT_REQUIRES(mutex_) {
    waiting_short_.store(queue_of(Lane::kShort).tasks, std::memory_order_relaxed);
  }

  // Constant after construction.
  const std::size_t lane_threads_;
  const std::array<int, 2> most_guests_;  // by kind
  const std::optional<Overrun> overrun_;
  const Clock clock_;
  const std::chrono::steady_clock::time_point epoch_;
  const std::shared_ptr<Share> own_ = std::make_shared<Share>();

  // Protected by mutex_.
  Mutex mutex_;
  std::array<Queue, 2> queues_;                           // by lane; of them, all but the condition
  std::condition_variable stopped_;                       // ends the watch
  double least_had_ms_ WARMFRONT_GUARDED_BY(mutex_) = 0;  // of those that waited, when one was last taken
  std::list<Thread> threads_ WARMFRONT_GUARDED_BY(mutex_);
  bool stopping_ WARMFRONT_GUARDED_BY(mutex_) = false;
  std::array<int, 2> guests_ WARMFRONT_GUARDED_BY(mutex_){};         // by kind
  const Share* last_packet_ WARMFRONT_GUARDED_BY(mutex_) = nullptr;  // whose the last one was
  double last_other_ms_ WARMFRONT_GUARDED_BY(mutex_) = -1e9;         // when that was another
  double last_short_ms_ WARMFRONT_GUARDED_BY(mutex_) = -1e9;  // when the last one began beside a long one

  std::atomic<int> busy_{0};
  std::atomic<int> relieved_{0};
  std::atomic<std::uint64_t> done_{0};
  std::atomic<std::size_t> waiting_short_{0};

  std::thread watch_;  // where tasks may overrun
};

}  // namespace warmfront::server

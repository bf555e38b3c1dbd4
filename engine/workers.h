// SPDX-License-Identifier: Apache-2.0
// The threads that steps run on. Thread-safe: many colliders may share one Workers and step concurrently.
#pragma once

#include <atomic>
#include <functional>
#include <memory>

namespace warmfront {

/// oneTBB arenas, one for each calling thread, so that no caller waits for another's work: oneTBB divides its
/// own threads among the arenas that have work. All run in the IEEE default environment (round to nearest, no
/// flush to zero), which the elementary tests' error bounds require, whatever the environment of the calling
/// threads.
class Workers {
 public:
  enum class Bounds {
    kOneCall,  ///< at most this many threads per call
    /// At most this many oneTBB threads in the process, the caller included, while this lives: for services.
    /// Small steps, which several threads take as long for as one, take one, and leave the others the cores.
    kProcess,
  };
  /// `threads` >= 1, or 0 for one per core, but for small steps (some 0.5 ms), which take one thread.
  explicit Workers(int threads = 0, Bounds bounds = Bounds::kOneCall);
  ~Workers();
  Workers(const Workers&) = delete;
  Workers& operator=(const Workers&) = delete;

  /// Number of threads that run() would use on the calling thread.
  int threads() const;

  /// Whether small steps take one thread: those of a process, or of which no number was asked for.
  bool adapts_to_steps() const;

  /// Runs `work` inside the calling thread's arena and returns when it is done; exceptions pass through.
  void run(const std::function<void()>& work);

  /// Runs `work`, whose own run()s, one after the other and none within another, enter the arena together,
  /// once: threads that help need not be woken up for each. What it does between them is serial; exceptions
  /// pass through.
  void enter_once(const std::function<void()>& work);

  /// Has threads that help the calling one wake up ahead of its next run(), of which they may miss the
  /// beginning otherwise: for a caller that has something else to do before. They soon sleep again without
  /// work.
  void rouse() noexcept;

  /// For the calling thread, before its first run(): while the flag is set, it, and oneTBB's threads that
  /// help in its calls, offer their core to others once a millisecond, at a look at the stop flag. Those that
  /// help have the process's priority, whatever this thread's own: so a caller that has stepped back really
  /// does.
  static void give_way_while(std::shared_ptr<const std::atomic<bool>> flag);
  /// Offers the core now, if the calling thread is to and a millisecond has passed. For long work of its own
  /// that no run() does.
  static void give_way();

  /// While one lives, every run() on the thread that created it uses this thread only: a small step need not
  /// wait for threads that a large one occupies. Must stay on one thread's stack.
  class OneThread {
   public:
    OneThread();
    ~OneThread();
    OneThread(const OneThread&) = delete;
    OneThread& operator=(const OneThread&) = delete;
  };

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace warmfront

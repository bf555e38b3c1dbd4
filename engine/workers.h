// SPDX-License-Identifier: Apache-2.0
// The threads that steps run on. Thread-safe: many colliders may share one Workers and step at once.
#pragma once

#include <functional>
#include <memory>

namespace warmfront {

/// oneTBB arenas, one for each thread that calls, so that none waits for what another has begun: oneTBB's own
/// threads divide themselves among those that have work. All run in the IEEE default environment (round to
/// nearest, no flush to zero), which the elementary tests' error bounds take for granted, whatever the
/// environment of the threads that make and call it.
class Workers {
 public:
  enum class Bounds {
    kOneCall,  ///< one call takes so many threads at most
    kProcess,  ///< oneTBB has so many in all, the one that calls included, while this lives
  };
  /// `threads` >= 1, or 0 for as many as the machine has.
  explicit Workers(int threads = 0, Bounds bounds = Bounds::kOneCall);
  ~Workers();
  Workers(const Workers&) = delete;
  Workers& operator=(const Workers&) = delete;

  /// That run() would use on the calling thread.
  int threads() const;

  /// Runs `work` inside the calling thread's arena and returns when it is done; exceptions pass through.
  void run(const std::function<void()>& work);

  /// While one lives, every run() of the thread that made it takes this thread alone: a small step does not
  /// look for the threads that a large one has taken. Lives on one thread's stack.
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

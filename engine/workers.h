// SPDX-License-Identifier: Apache-2.0
// The threads that steps run on. Thread-safe: many colliders may share one Workers and step at once.
#pragma once

#include <functional>
#include <memory>

namespace warmfront {

/// A oneTBB arena whose threads all run in the IEEE default environment (round to nearest, no flush to zero),
/// which the elementary tests' error bounds take for granted, whatever the environment of the threads that
/// make and call it.
class Workers {
 public:
  /// `threads` >= 1, or 0 for as many as the machine has.
  explicit Workers(int threads = 0);
  ~Workers();
  Workers(const Workers&) = delete;
  Workers& operator=(const Workers&) = delete;

  /// That run() would use on the calling thread.
  int threads() const;

  /// Runs `work` inside the arena and returns when it is done; exceptions pass through.
  void run(const std::function<void()>& work);

  /// While one lives, every run() of the thread that made it takes this thread alone, in an arena of its own
  /// with one slot: a small step does not wait for the threads that a large one has taken. Lives on one
  /// thread's stack.
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

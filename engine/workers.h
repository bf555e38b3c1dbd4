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

  int threads() const;

  /// Runs `work` inside the arena and returns when it is done; exceptions pass through.
  void run(const std::function<void()>& work);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace warmfront

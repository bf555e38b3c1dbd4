// SPDX-License-Identifier: Apache-2.0
// How much a step may write into the front, counted by all threads together. Thread-safe, but for begin() and
// allow().
#pragma once

#include <atomic>
#include <cstddef>

namespace warmfront {

/// Pairs, and the answers that are kept with them. What a thread has in hand counts, so that no step holds
/// more than the cap, but for a block of pairs a thread. Both verdicts depend on the sums alone, which are
/// the same for any number of threads: sums only grow, so whoever sees one beyond the cap may stop writing.
class FrontRoom {
 public:
  explicit FrontRoom(std::size_t pair_bytes) : pair_bytes_(pair_bytes) {}

  void begin() {
    pairs_.store(0, std::memory_order_relaxed);
    answers_.store(0, std::memory_order_relaxed);
  }

  void allow(std::size_t max_bytes) { max_bytes_ = max_bytes; }

  /// Counts pairs. False when there are more than there is room for: the front is lost.
  bool take_pairs(std::size_t count) {
    pairs_.fetch_add(count, std::memory_order_relaxed);
    return !pairs_lost();
  }
  /// Counts bytes of answers. False when there is no room for these and the pairs: the answers are lost.
  bool take_answers(std::size_t bytes) {
    answers_.fetch_add(bytes, std::memory_order_relaxed);
    return !answers_lost();
  }

  std::size_t pairs() const { return pairs_.load(std::memory_order_relaxed); }
  bool pairs_lost() const { return pairs() > max_bytes_ / pair_bytes_; }
  bool answers_lost() const {
    return pairs() * pair_bytes_ + answers_.load(std::memory_order_relaxed) > max_bytes_;
  }

 private:
  const std::size_t pair_bytes_;
  std::size_t max_bytes_ = 0;
  std::atomic<std::size_t> pairs_{0};
  std::atomic<std::size_t> answers_{0};  // bytes
};

}  // namespace warmfront

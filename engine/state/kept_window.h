// SPDX-License-Identifier: Apache-2.0
// A question of how far distances are kept, asked in turns. Plain values; used by one thread at a time.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <span>
#include <vector>

#include "engine/scene/held_bytes.h"

namespace warmfront {

/// The widest separation of a pair that is met at all grows with the way until then, and of a long motion
/// most comes after what stops it. So culls go by a narrow separation first, about as wide as an edge is
/// long: what stops the motion then may not be first, but nothing later is needed. What is met by then has a
/// separation that follows from the way up to there. Where that is still much wider, a wider one is tried
/// before it.
class KeptWindow {
 public:
  /// A question begins, of which nothing is known.
  void begin() noexcept {
    turn_ = 0;
    narrowed_ = false;
    until_.clear();
  }

  /// By place of a world, times after which no contact is needed, none of which is earlier than the first one
  /// there; empty where none is known.
  std::span<const double> until() const { return until_; }
  /// The last of them, in [0, 1].
  double latest() const {
    if (until_.empty()) return 1;
    return std::min(1.0, *std::ranges::max_element(until_));
  }

  /// What culls go by in this turn, where `widest` is at least every separation that counts, `beyond` what
  /// all have, and `length` that of an edge.
  double narrow(double widest, double beyond, double length) noexcept {
    const double tried = beyond + std::ldexp(length, kDoublings * turn_);
    narrowed_ = length > 0 && turn_ < kMostTurns && widest > beyond + kMuchWider * (tried - beyond);
    return narrowed_ ? tried : widest;
  }
  /// Did they go by less, so that contacts may be missing?
  bool narrowed() const { return narrowed_; }
  /// The next turn, after one that found these first times by place of a world, or more than 1.
  void next(std::span<const double> first) {
    if (until_.empty()) until_.assign(first.size(), 2.0);
    for (std::size_t i = 0; i < first.size(); ++i) until_[i] = std::min(until_[i], first[i]);
    ++turn_;
  }

  std::size_t memory_bytes() const { return held_bytes(until_); }

 private:
  static constexpr int kDoublings = 3;
  static constexpr double kMuchWider = 4;
  /// Where edges are that short beside the motion, trying wider ones only repeats the question.
  static constexpr int kMostTurns = 8;

  std::vector<double> until_;
  int turn_ = 0;
  bool narrowed_ = false;
};

}  // namespace warmfront

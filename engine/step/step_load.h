// SPDX-License-Identifier: Apache-2.0
// Whether a question is so small that one thread answers it as soon as several. Used by one thread at a time.
#pragma once

#include <cstdint>

#include "engine/options.h"
#include "engine/statistics.h"

namespace warmfront {

/// Told by the last question: one like it takes as long. To wake another thread, which looks for work for
/// some 0.3 ms before it sleeps again, takes some 0.05 ms, of which a small step would have little.
class StepLoad {
 public:
  /// What comes next may do much more than what came last: the scene, or what is kept of it, is another one.
  void forget() noexcept { known_ = false; }
  /// A question of these options did so much.
  void took(const ColliderOptions& options, const StepCounts& counts) noexcept {
    known_ = true;
    pair_test_ = options.pair_test;
    report_ = options.report;
    tier_ = options.tier;
    min_separation_ = options.min_separation;
    counts_ = counts;
  }
  /// Is one of these options small, in a scene of so many triangles and lone edges?
  bool is_small(const ColliderOptions& options, std::uint64_t elements) const {
    const bool alike = known_ && options.pair_test == pair_test_ && options.report == report_ &&
                       options.tier == tier_ && options.min_separation <= min_separation_;
    // An exact test of integers takes many times as long as others.
    constexpr double kSmallMs = 0.5, kExactMs = 0.002;
    return alike &&
           step_cost_ms(elements, counts_) + kExactMs * static_cast<double>(counts_.exact_tests) <= kSmallMs;
  }

 private:
  bool known_ = false;
  PairTest pair_test_{};
  Report report_{};
  Tier tier_{};
  double min_separation_ = 0;
  StepCounts counts_;
};

}  // namespace warmfront

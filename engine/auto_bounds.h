// SPDX-License-Identifier: Apache-2.0
// Picks the kind of bounds by trying. Used by one thread at a time.
#pragma once

#include <array>
#include <cstddef>
#include <memory>

#include "engine/pipeline.h"

namespace warmfront {

/// Begins with 18-DOPs. Where, once warm, refitting them is most of a step's time, AABBs, a third of their
/// size, are tried for some steps, and stay if these were clearly faster. A scene whose steps go into the
/// front is not bothered: AABBs hold more pairs together that are apart, so they cannot win there.
class BoundsTrial {
 public:
  BoundsKind bounds() const { return bounds_; }
  /// Takes down what a step took. Returns whether bounds() is another one from now on.
  bool take(const StageTimes& ms);

  static constexpr std::size_t kSettling = 3;  ///< steps after a cold start before the clock counts
  static constexpr std::size_t kCounted = 8;   ///< steps that it then counts
  static constexpr double kShare = 0.6;        ///< of a step that refit must take for a trial
  static constexpr double kGain = 0.9;         ///< of the 18-DOPs' time that AABBs may take to stay

 private:
  bool change_to(BoundsKind bounds);

  BoundsKind bounds_ = BoundsKind::kKDop18;
  bool decided_ = false;
  std::size_t steps_ = 0;  // with these bounds
  std::array<double, kCounted> total_{};
  std::array<double, kCounted> refit_{};
  double kdop_ms_ = 0;
};

/// A pipeline that follows such a trial. The contacts are the same; the trial costs two fronts built from
/// scratch at most.
std::unique_ptr<Pipeline> make_auto_pipeline();

}  // namespace warmfront

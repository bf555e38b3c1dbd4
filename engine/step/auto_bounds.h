// SPDX-License-Identifier: Apache-2.0
// Picks the kind of bounds by trying. Used by one thread at a time.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>

#include "engine/step/pipeline.h"

namespace warmfront {

/// Begins with 18-DOPs. AABBs are a third of their size, so that a vertex that moves costs less, but let some
/// twice as many pairs through to the tests of primitives. Where, once warm, there are fewer tests than
/// vertices that move, AABBs are tried for some steps, and stay if they let hardly more through. By counts,
/// not by the clock: the same frames lead to the same bounds, and so to the same counts, on any machine.
class BoundsTrial {
 public:
  BoundsKind bounds() const { return bounds_; }
  /// Takes down what a step counted. Returns whether bounds() is another one from now on.
  bool take(const StepCounts& counts);

  static constexpr std::size_t kSettling = 3;  ///< steps with new bounds before any is counted
  static constexpr std::size_t kCounted = 8;   ///< steps that then are: of those in which something moved
  /// Tests of primitives that a pair of triangles that they let through is worth.
  static constexpr std::uint64_t kPairWeight = 10;

 private:
  bool change_to(BoundsKind bounds);

  BoundsKind bounds_ = BoundsKind::kKDop18;
  bool decided_ = false;
  std::size_t steps_ = 0;  // with these bounds
  std::array<std::uint64_t, kCounted> moved_{};
  std::array<std::uint64_t, kCounted> tests_{};
  std::uint64_t kdop_tests_ = 0;
};

/// A pipeline that follows such a trial; for Report::kEarliest, whose counts depend on which thread comes
/// first, with 18-DOPs throughout. The contacts are the same; the trial costs two fronts built from scratch
/// at most.
std::unique_ptr<Pipeline> make_auto_pipeline();

}  // namespace warmfront

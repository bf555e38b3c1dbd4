// SPDX-License-Identifier: Apache-2.0
// The motion of a trial, by which a later one from the same start is recognised as part of it: the next trial
// of a line search. Used by one thread at a time.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "engine/motion/motion.h"
#include "engine/stop.h"

namespace warmfront {

/// How far, as a share of the scene's magnitude, a vertex may end beside the straight line of a longer trial
/// for a trial to count as part of it: what rounding X + s (Y - X) to float32 takes. Each coordinate; in the
/// local frame. Everything that a trial excludes stays excluded when vertices go beside their lines by this
/// much: bounds (moving.h), planes between parts (apart_parts.h) and rigid parts (rigid_parts.h) leave room
/// for it.
inline constexpr double kBesideTheWay = 0x1p-22;

/// The same as a distance, of two vertices together: 2 sqrt(3) < 4.
inline constexpr double kPairBesideTheWay = 4 * kBesideTheWay;

class TrialWay {
 public:
  /// Remembers the motion that was begun. Where nothing moves, or not by finite local lengths, nothing is
  /// known. Throws Stopped when told to stop; nothing is known then.
  void take(const Motion& motion, StopSignal stop);
  void forget() noexcept { known_ = false; }
  bool known() const { return known_; }

  /// The fraction s in [0, 1] such that the motion that was begun, which starts where the remembered one
  /// does, takes every vertex to X + s (Y - X), but for kBesideTheWay of `magnitude` (what take() saw, too);
  /// what rested then rests now. None if there is no such fraction. Throws Stopped when told to stop.
  std::optional<double> fraction_of(const Motion& motion, double magnitude, StopSignal stop) const;

  std::size_t memory_bytes() const { return displacement_.capacity() * sizeof displacement_[0]; }

 private:
  using Displacement = std::array<float, 4>;  // in the local frame; the fourth lane is zero

  std::vector<Displacement> displacement_;  // by vertex
  std::size_t farthest_ = 0;                // the vertex and axis of the largest one
  int axis_ = 0;
  bool known_ = false;
};

}  // namespace warmfront

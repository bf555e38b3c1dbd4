// SPDX-License-Identifier: Apache-2.0
// The motion of a rigid body along the screw between two of its poses, a constant twist, instead of along
// lines. Plain values and pure functions; the same bits on every machine, so that both ends of a connection
// agree.
#pragma once

#include <array>

#include "engine/pose.h"

namespace warmfront {

/// The constant twist that leads from one pose to another in a time of 1: a point x has the velocity
/// angular x (x - centre) + linear.
struct Twist {
  std::array<double, 3> angular{};  ///< radians along the axis of the rotation, at most pi
  std::array<double, 3> centre{};   ///< the translation of the first pose
  std::array<double, 3> linear{};   ///< velocity of the centre
  double angle_squared = 0;         ///< of `angular`; 0: along lines
  double chord_bend = 0.5;          ///< B(1) of arc_shares()
  double chord_turn = 1.0 / 6;      ///< C(1)

  /// angular x (velocity at x): how a point that begins at x bends off its line.
  std::array<double, 3> bend_at(const std::array<double, 3>& x) const;
};

/// By the logarithm of the rotation between the two poses, which turns by less than half a turn; by half a
/// turn it may go either way round, and is the same one on every machine. Whatever the matrices are, the
/// result is finite where these and their differences are.
Twist twist_between(const Pose& from, const Pose& to);

/// What a point has of its bend p, and of q = angular x p, beside its line, at time s in [0, 1]:
///
///   x(s) = x(0) + s (x(1) - x(0)) + of_bend p + of_turn q,
///   of_bend = B(s) - s B(1),  B(s) = (1 - cos(a s)) / a^2,
///   of_turn = C(s) - s C(1),  C(s) = (a s - sin(a s)) / a^3,
///
/// with the angle a: the exponential of the twist (Murray, Li and Sastry, A Mathematical Introduction to
/// Robotic Manipulation, 2.3), less its own chord. Both are 0 at s = 0 and 1, so a motion ends, bit for bit,
/// where the poses place a point, though their matrices are rotations only as nearly as they were given. The
/// second derivative of x is as long as p at all times, so that between s and s + h a point is within
/// h^2 |p| / 8 of its chord.
struct ArcShares {
  double of_bend = 0;
  double of_turn = 0;
};
/// By their power series; within 2^-49.
ArcShares arc_shares(const Twist& twist, double s);

/// The same, and how they change: B' (s) - B(1) and C' (s) - C(1), with B' = sin(a s) / a and C' = B.
struct ArcRates {
  ArcShares shares;
  ArcShares rates;
};
ArcRates arc_rates(const Twist& twist, double s);

/// Where a body is `fraction`, in [0, 1], of the way along the screw from one pose to another: each column of
/// the matrix by the formula above, in double, in a stated order; `to` itself at fraction 1 and `from` itself
/// at 0. Between these each number is rounded to the nearest float32 with `single`, where the two poses are
/// expected to be in_float32() already. Numbers that would not be finite are those of part_way().
Pose screw_way(const Pose& from, const Pose& to, double fraction, bool single);

}  // namespace warmfront

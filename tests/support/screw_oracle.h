// SPDX-License-Identifier: Apache-2.0
// Where a screw takes a point, by Chasles' theorem in long double: a turn about an axis and a way along it.
// An oracle for engine/screw.h, which knows of no axis. Plain values.
#pragma once

#include <array>

#include "engine/pose.h"
#include "tests/support/draws.h"

namespace warmfront::testing {

using Long3 = std::array<long double, 3>;

class ScrewOracle {
 public:
  /// Between two poses whose rotations differ by less than half a turn.
  ScrewOracle(const Pose& from, const Pose& to);

  /// Of a point that begins at x; s in [0, 1].
  Long3 at(const Long3& x, long double s) const;
  /// No point within `radius` of x travels faster.
  long double fastest(const Long3& x, long double radius) const;

  long double angle() const { return angle_; }

 private:
  Long3 axis_{};
  Long3 on_axis_{};
  long double angle_ = 0;
  Long3 along_{};  // the way along the axis; all of it where nothing turns
};

/// A rotation by an angle in radians about a drawn axis, then a translation of up to `way` along each axis.
Pose drawn_pose(Draws& draws, double angle, double way);
/// The second pose after the first.
Pose after(const Pose& first, const Pose& second);

}  // namespace warmfront::testing

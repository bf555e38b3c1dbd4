// SPDX-License-Identifier: Apache-2.0
// Where part of a linear motion ends: the formula of Collider::commit(). Pure functions.
#pragma once

#include "engine/pose.h"

namespace warmfront {

/// from + fraction * (to - from), in double, each operation rounded once; `to` itself at fraction 1 and
/// `from` itself at 0. Where to - from is beyond double's range: (1 - fraction) * from + fraction * to. With
/// `single` these are then rounded to the nearest float32. `fraction` in [0, 1]. Out of line, so that no
/// compiler contracts or leaves out a rounding: see in_float32().
double part_way(double from, double to, double fraction, bool single);

/// The same for each number of a pose. For 0 < fraction < 1 the result is in general no rotation: its
/// vertices lie on the straight lines between the two poses, as they do within a step.
Pose part_way(const Pose& from, const Pose& to, double fraction, bool single);

}  // namespace warmfront

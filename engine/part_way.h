// SPDX-License-Identifier: Apache-2.0
// Where part of a linear motion ends: the formula of Collider::commit(). Pure functions.
#pragma once

#include "engine/pose.h"

namespace warmfront {

/// from + fraction * (to - from), in double, each operation rounded once; `to` itself at fraction 1 and
/// `from` itself at 0. Where to - from is beyond double's range: (1 - fraction) * from + fraction * to. With
/// `single` these are then rounded to the nearest float32. `fraction` in [0, 1]. Out of line, so that no
/// compiler contracts or leaves out a rounding: see in_float32().
///
/// Of numbers up to m the roundings sum up to less than 6 m 2^-53, and with `single` to 2^-24 m more (beside
/// what underflows). So they bring two features whose vertices go part of their way nearer to each other, or
/// farther away, by less than 2^-48 m, with `single` by less than 2^-22 m (2 sqrt(3) times as much as each
/// coordinate). What is nearer may be taken through each other by them: Collider::max_step() leaves room for
/// that (motion/commit_room.h), and a trial leaves none.
double part_way(double from, double to, double fraction, bool single);

/// The same for each number of a pose. For 0 < fraction < 1 the result is in general no rotation: its
/// vertices lie on the straight lines between the two poses, as they do within a step. There the m of the
/// roundings is the largest number of both translations plus three times that of the reference shape.
Pose part_way(const Pose& from, const Pose& to, double fraction, bool single);

}  // namespace warmfront

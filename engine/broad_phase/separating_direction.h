// SPDX-License-Identifier: Apache-2.0
// A direction along which two small parts stay apart throughout a step. Pure function.
// Source: the search is Gilbert, Johnson, Keerthi 1988, over the Minkowski difference at both ends at once.
#pragma once

#include <array>
#include <optional>

#include "engine/motion/moving_points.h"

namespace warmfront {

/// What a gap must be for two parts to be taken for apart, in the local frame.
struct WantedGap {
  double least = 0;          ///< more than this
  double share_of_size = 0;  ///< and this share of the size on top: as Query::size, of the parts
};

/// A unit vector n such that, at t = 0 and at t = 1 and hence (gaps between vertices along a fixed direction
/// are linear in time) throughout the step, all of `b` lies farther along n than all of `a`, by more than
/// what is wanted; rounding is accounted for. None where none is found: the parts touch, nearly do, are
/// hollow and one is in the other, or the search ended too early. It starts from the unit vector `first`, if
/// there is one, such as what was found in the step before.
std::optional<std::array<double, 3>> separating_direction(
    const MovingPoints& a, const MovingPoints& b, const LocalTransform& frame, const WantedGap& wanted,
    const std::optional<std::array<double, 3>>& first = std::nullopt);

}  // namespace warmfront

// SPDX-License-Identifier: Apache-2.0
// A direction along which two small parts stay apart throughout a step. Pure function.
// Source: the search is Gilbert, Johnson, Keerthi 1988, over the Minkowski difference at both ends at once.
#pragma once

#include <array>
#include <optional>

#include "engine/motion/moving_points.h"

namespace warmfront {

/// The gap that proves two parts apart, in the local frame.
struct WantedGap {
  double least = 0;          ///< more than this
  double share_of_size = 0;  ///< plus this fraction of the parts' size, as in Query::size
};

/// A unit vector n such that, at t = 0 and at t = 1 and hence (gaps between vertices along a fixed direction
/// are linear in time) throughout the step, all of `b` lies farther along n than all of `a`, by more than the
/// wanted gap; rounding is accounted for. None if none is found: the parts touch, nearly touch, one is in the
/// hollow of the other, or the search ended too early. Starts from the unit vector `first` if given, for
/// example the previous step's result.
std::optional<std::array<double, 3>> separating_direction(
    const MovingPoints& a, const MovingPoints& b, const LocalTransform& frame, const WantedGap& wanted,
    const std::optional<std::array<double, 3>>& first = std::nullopt);

}  // namespace warmfront

// SPDX-License-Identifier: Apache-2.0
// How much linear maps between two others shrink distances. Plain functions.
#pragma once

#include <array>

namespace warmfront {

using LinearMap = std::array<double, 9>;  ///< row-major, 3x3

/// What remains_spread() promises: all of (1 - t) from + t to, 0 <= t <= 1, take a vector of length 1 to one
/// of more than kLeastStretch (less than cos(45 degrees)), and both ends take it to one of less than
/// kMostStretch.
inline constexpr double kLeastStretch = 0.7;
inline constexpr double kMostStretch = 1.5;

/// A proof, where true. True for two rotations of less than 90 degrees from each other, and for two maps
/// between rotations that are not as far apart; false for what shrinks distances by more, mirrors, or is not
/// finite.
bool remains_spread(const LinearMap& from, const LinearMap& to);

}  // namespace warmfront

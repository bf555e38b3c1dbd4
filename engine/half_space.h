// SPDX-License-Identifier: Apache-2.0
// A half-space: a body without a mesh. A plain value.
#pragma once

#include <array>

namespace warmfront {

/// All points x with normal . (x - point) <= 0: `normal` points out of it. As it is at the identity pose.
struct HalfSpace {
  std::array<double, 3> point{};   ///< finite, in the scene's unit
  std::array<double, 3> normal{};  ///< finite, at most 2^1020 in each coordinate, not zero; of any length

  friend bool operator==(const HalfSpace&, const HalfSpace&) = default;
};

}  // namespace warmfront

// SPDX-License-Identifier: Apache-2.0
// Where a pose places a vertex. For the engine's own loops: in its files nothing is contracted.
#pragma once

#include <array>

#include "engine/pose.h"

namespace warmfront {

/// Pose::place(), inline.
inline std::array<double, 3> place(const Pose& pose, const double* x) {
  std::array<double, 3> placed;
  for (int row = 0; row < 3; ++row) {
    const double* m = pose.matrix.data() + 4 * row;
    placed[row] = ((m[0] * x[0] + m[1] * x[1]) + m[2] * x[2]) + m[3];
  }
  return placed;
}

}  // namespace warmfront

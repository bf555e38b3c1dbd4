// SPDX-License-Identifier: Apache-2.0
// Where a pose places vertices. For the engine's own loops: in its files nothing is contracted.
#pragma once

#include <array>

#include "engine/pose.h"

namespace warmfront {

/// Pose::place(), inline, of many vertices.
class PlacedBy {
 public:
  explicit PlacedBy(const Pose& pose) : pose_(pose), stays_(pose == Pose{}) {}

  std::array<double, 3> operator()(const double* x) const {
    if (stays_) return {x[0], x[1], x[2]};
    std::array<double, 3> placed;
    for (int row = 0; row < 3; ++row) {
      const double* m = pose_.matrix.data() + 4 * row;
      placed[row] = ((m[0] * x[0] + m[1] * x[1]) + m[2] * x[2]) + m[3];
    }
    return placed;
  }

 private:
  const Pose& pose_;
  bool stays_;
};

}  // namespace warmfront

// SPDX-License-Identifier: Apache-2.0
// The pose that best maps a reference shape to given positions. Pure function.
#pragma once

#include <span>

#include "engine/pose.h"

namespace warmfront::client {

struct PoseFit {
  Pose pose;
  double residual = 0;  ///< largest distance of a vertex from its posed position
};

/// The rotation and translation with the least sum of squared distances (Kabsch 1976; Umeyama 1991). `rest`
/// and `placed`: (k, 3), k >= 1.
PoseFit fit_pose(std::span<const double> rest, std::span<const double> placed);

}  // namespace warmfront::client

// SPDX-License-Identifier: Apache-2.0
// Poses that only shift, or only turn. Pure functions.
#pragma once

#include <cmath>

#include "engine/pose.h"

namespace warmfront::testing {

inline Pose shifted(double x, double y, double z) {
  Pose pose;
  pose.matrix[3] = x;
  pose.matrix[7] = y;
  pose.matrix[11] = z;
  return pose;
}

inline Pose turned_about_x(double angle) {
  Pose pose;
  pose.matrix = {1, 0, 0, 0, 0, std::cos(angle), -std::sin(angle), 0, 0, std::sin(angle), std::cos(angle), 0};
  return pose;
}

}  // namespace warmfront::testing

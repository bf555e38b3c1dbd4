// SPDX-License-Identifier: Apache-2.0
#include "engine/pose.h"

#include <cmath>

namespace warmfront {

Pose in_float32(const Pose& pose) {
  Pose rounded;
  for (std::size_t i = 0; i < pose.matrix.size(); ++i) rounded.matrix[i] = static_cast<float>(pose.matrix[i]);
  return rounded;
}

Status check_pose(const Pose& pose, const std::string& where) {
  const auto& m = pose.matrix;
  for (std::size_t i = 0; i < m.size(); ++i) {
    if (!std::isfinite(m[i]))
      return invalid_argument(where + "[" + std::to_string(i) + "]: is " +
                              (std::isnan(m[i]) ? "not a number" : "infinite") +
                              "; a pose is a finite 3x4 matrix");
  }
  const auto column = [&](int c, int row) { return m[4 * row + c]; };
  for (int a = 0; a < 3; ++a) {
    for (int b = a; b < 3; ++b) {
      double dot = 0;
      for (int row = 0; row < 3; ++row) dot += column(a, row) * column(b, row);
      // Written so that an overflow to not a number fails, too.
      if (!(std::fabs(dot - (a == b ? 1 : 0)) <= kPoseTolerance))
        return invalid_argument(where + ": is not rigid: columns " + std::to_string(a) + " and " +
                                std::to_string(b) + " of its 3x3 part have the product " +
                                std::to_string(dot) + " where " + (a == b ? "1" : "0") +
                                " is expected; give a rotation, or make the body deformable");
    }
  }
  const double determinant = m[0] * (m[5] * m[10] - m[6] * m[9]) - m[1] * (m[4] * m[10] - m[6] * m[8]) +
                             m[2] * (m[4] * m[9] - m[5] * m[8]);
  if (!(determinant > 0))
    return invalid_argument(where + ": is not rigid: its 3x3 part mirrors; give a rotation");
  return {};
}

}  // namespace warmfront

// SPDX-License-Identifier: Apache-2.0
#include "engine/pose.h"

#include <cmath>

#include "engine/motion/place.h"

namespace warmfront {

std::array<double, 3> Pose::place(const double* x) const {
  return PlacedBy(*this)(x);
}

Pose in_float32(const Pose& pose) {
  Pose rounded;
  for (std::size_t i = 0; i < pose.matrix.size(); ++i) rounded.matrix[i] = static_cast<float>(pose.matrix[i]);
  return rounded;
}

namespace {

// What a rotation is given with, its errors add up to: three of kPoseTolerance lengthen by as much, and the
// way along a screw between two such by a little more.
constexpr double kMostLonger = 16 * kPoseTolerance;

// Is R^T R at most the identity, give or take that? Their difference then has no negative leading minor
// (Sylvester).
Status check_lengthens_nothing(const Pose& pose, const std::string& where) {
  double d[3][3];
  for (int a = 0; a < 3; ++a) {
    for (int b = 0; b < 3; ++b) {
      d[a][b] = a == b ? 1 + kMostLonger : 0;
      for (int row = 0; row < 3; ++row) d[a][b] -= pose.matrix[4 * row + a] * pose.matrix[4 * row + b];
    }
  }
  const double two = d[0][0] * d[1][1] - d[0][1] * d[1][0];
  const double three = d[0][0] * (d[1][1] * d[2][2] - d[1][2] * d[2][1]) -
                       d[0][1] * (d[1][0] * d[2][2] - d[1][2] * d[2][0]) +
                       d[0][2] * (d[1][0] * d[2][1] - d[1][1] * d[2][0]);
  if (d[0][0] > 0 && two > 0 && three > 0) return {};
  return invalid_argument(where +
                          ": its 3x3 part lengthens something; give a rotation, or what a commit left");
}

}  // namespace

Status check_pose(const Pose& pose, const std::string& where, PoseCheck check) {
  const auto& m = pose.matrix;
  for (std::size_t i = 0; i < m.size(); ++i) {
    if (!std::isfinite(m[i]))
      return invalid_argument(where + "[" + std::to_string(i) + "]: is " +
                              (std::isnan(m[i]) ? "not a number" : "infinite") +
                              "; a pose is a finite 3x4 matrix");
  }
  if (check == PoseCheck::kPartWay) return check_lengthens_nothing(pose, where);
  const auto column = [&](int c, int row) { return m[4 * row + c]; };
  for (int a = 0; a < 3; ++a) {
    for (int b = a; b < 3; ++b) {
      double dot = 0;
      for (int row = 0; row < 3; ++row) dot += column(a, row) * column(b, row);
      // Written so that an overflow to not a number fails, too.
      if (!(std::fabs(dot - (a == b ? 1 : 0)) <= kPoseTolerance))
        return invalid_argument(
            where + ": is not rigid: columns " + std::to_string(a) + " and " + std::to_string(b) +
            " of its 3x3 part have the product " + std::to_string(dot) + " where " + (a == b ? "1" : "0") +
            " is expected, give or take 1e-5; give a rotation, made orthonormal again where it is "
            "a product of many, or make the body deformable");
    }
  }
  const double determinant = m[0] * (m[5] * m[10] - m[6] * m[9]) - m[1] * (m[4] * m[10] - m[6] * m[8]) +
                             m[2] * (m[4] * m[9] - m[5] * m[8]);
  if (!(determinant > 0))
    return invalid_argument(where + ": is not rigid: its 3x3 part mirrors; give a rotation");
  return {};
}

}  // namespace warmfront

// SPDX-License-Identifier: Apache-2.0
#include "tests/support/screw_oracle.h"

#include <cmath>

namespace warmfront::testing {
namespace {

Long3 cross(const Long3& a, const Long3& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
long double dot(const Long3& a, const Long3& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}
Long3 plus(const Long3& a, long double s, const Long3& b) {
  return {a[0] + s * b[0], a[1] + s * b[1], a[2] + s * b[2]};
}
long double entry(const Pose& pose, int row, int column) {
  return pose.matrix[static_cast<std::size_t>(4 * row + column)];
}

}  // namespace

ScrewOracle::ScrewOracle(const Pose& from, const Pose& to) {
  long double q[3][3];
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      q[i][j] = 0;
      for (int k = 0; k < 3; ++k) q[i][j] += entry(to, i, k) * entry(from, j, k);
    }
  }
  Long3 way;  // x goes to q x + way
  for (int i = 0; i < 3; ++i) {
    way[i] = entry(to, i, 3);
    for (int j = 0; j < 3; ++j) way[i] -= q[i][j] * entry(from, j, 3);
  }
  const Long3 twice_sine{q[2][1] - q[1][2], q[0][2] - q[2][0], q[1][0] - q[0][1]};
  const long double length = std::sqrt(dot(twice_sine, twice_sine));
  if (length == 0) {
    along_ = way;
    return;
  }
  angle_ = std::atan2(length, q[0][0] + q[1][1] + q[2][2] - 1);
  axis_ = plus({}, 1 / length, twice_sine);
  along_ = plus({}, dot(axis_, way), axis_);
  const Long3 across = plus(way, -1, along_);
  on_axis_ =
      plus({across[0] / 2, across[1] / 2, across[2] / 2}, 0.5L / std::tan(angle_ / 2), cross(axis_, across));
}

Long3 ScrewOracle::at(const Long3& x, long double s) const {
  const Long3 arm = plus(x, -1, on_axis_);
  const Long3 turned = cross(axis_, arm);
  const long double angle = s * angle_;
  Long3 at = plus(x, std::sin(angle), turned);
  at = plus(at, 2 * std::sin(angle / 2) * std::sin(angle / 2), cross(axis_, turned));
  return plus(at, s, along_);
}

long double ScrewOracle::fastest(const Long3& x, long double radius) const {
  const Long3 turned = cross(axis_, plus(x, -1, on_axis_));
  return angle_ * (std::sqrt(dot(turned, turned)) + radius) + std::sqrt(dot(along_, along_));
}

Pose drawn_pose(Draws& draws, double angle, double way) {
  Long3 axis;
  long double square = 0;
  while (square < 0.01L) {
    for (long double& x : axis) x = draws.uniform(1);
    square = dot(axis, axis);
  }
  for (long double& x : axis) x /= std::sqrt(square);
  const long double c = std::cos(static_cast<long double>(angle));
  const long double s = std::sin(static_cast<long double>(angle));
  const long double cross_of[3][3] = {{0, -axis[2], axis[1]}, {axis[2], 0, -axis[0]}, {-axis[1], axis[0], 0}};
  Pose pose;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      const long double turned = (i == j ? c : 0) + (1 - c) * axis[i] * axis[j] + s * cross_of[i][j];
      pose.matrix[static_cast<std::size_t>(4 * i + j)] = static_cast<double>(turned);
    }
    pose.matrix[static_cast<std::size_t>(4 * i + 3)] = draws.uniform(way);
  }
  return pose;
}

Pose after(const Pose& first, const Pose& second) {
  Pose both;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 4; ++j) {
      long double sum = j == 3 ? entry(second, i, 3) : 0;
      for (int k = 0; k < 3; ++k) sum += entry(second, i, k) * entry(first, k, j);
      both.matrix[static_cast<std::size_t>(4 * i + j)] = static_cast<double>(sum);
    }
  }
  return both;
}

}  // namespace warmfront::testing

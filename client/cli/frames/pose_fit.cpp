// SPDX-License-Identifier: Apache-2.0
#include "client/cli/frames/pose_fit.h"

#include <Eigen/Geometry>
#include <Eigen/SVD>
#include <algorithm>

namespace warmfront::client {

PoseFit fit_pose(std::span<const double> rest, std::span<const double> placed) {
  using Points = Eigen::Map<const Eigen::Matrix<double, 3, Eigen::Dynamic>>;
  const auto count = static_cast<Eigen::Index>(rest.size() / 3);
  const Points from(rest.data(), 3, count);
  const Points to(placed.data(), 3, count);
  const Eigen::Matrix4d matrix = Eigen::umeyama(from, to, false);
  PoseFit fit;
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 4; ++column) fit.pose.matrix[4 * row + column] = matrix(row, column);
  }
  for (Eigen::Index i = 0; i < count; ++i) {
    const auto x = fit.pose.place(rest.data() + 3 * i);
    fit.residual = std::max(fit.residual, (Eigen::Vector3d(x[0], x[1], x[2]) - to.col(i)).norm());
  }
  return fit;
}

}  // namespace warmfront::client

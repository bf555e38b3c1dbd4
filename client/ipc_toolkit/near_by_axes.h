// SPDX-License-Identifier: Apache-2.0
// Whether two features are near each other as far as their 18-DOPs tell, at one instant. A pure function.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>

namespace warmfront::ipc_toolkit {

/// Four vertices, of which the first `first_count` are the first feature's.
using FourPoints = std::array<std::array<double, 3>, 4>;

/// False only where one of nine axes keeps the features more than `separation` apart. Coordinates are taken
/// relative to a vertex of the pair, so that roundings are of its own size; `slack` is more than all of them,
/// and less than what a collider allows for its own: what is near here, it has listed.
inline bool near_by_axes(FourPoints points, std::size_t first_count, double separation) {
  double size = 0;
  for (std::size_t k = 1; k < 4; ++k) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      points[k][axis] -= points[0][axis];
      size = std::max(size, std::abs(points[k][axis]));
    }
  }
  points[0] = {};
  const double slack = 0x1p-50 * size;
  const auto apart = [&](double x, double y, double z, double separated) {
    std::array<double, 4> at;
    for (std::size_t k = 0; k < 4; ++k) at[k] = x * points[k][0] + y * points[k][1] + z * points[k][2];
    const auto middle = at.begin() + static_cast<std::ptrdiff_t>(first_count);
    const auto [lo, hi] = std::minmax_element(at.begin(), middle);
    const auto [other_lo, other_hi] = std::minmax_element(middle, at.end());
    return *lo - *other_hi > separated + slack || *other_lo - *hi > separated + slack;
  };
  const double across = separation * std::numbers::sqrt2;
  return !apart(1, 0, 0, separation) && !apart(0, 1, 0, separation) && !apart(0, 0, 1, separation) &&
         !apart(1, 1, 0, across) && !apart(1, -1, 0, across) && !apart(1, 0, 1, across) &&
         !apart(1, 0, -1, across) && !apart(0, 1, 1, across) && !apart(0, 1, -1, across);
}

}  // namespace warmfront::ipc_toolkit

// SPDX-License-Identifier: Apache-2.0
#include "engine/elementary/distance_below.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <limits>

#include "engine/simd/lanes.h"

namespace warmfront {
namespace {

// The nearest multiple of 2^-24 to an x in [-1, 1]: sums of these, and products of two, are exact.
double on_grid(double x) {
  return (x + 0x1.8p28) - 0x1.8p28;
}

/// Points on the grid, eight at most.
struct Hull {
  std::array<Vec3, 8> points;
  std::size_t count = 0;

  void add(const Vec3& point) { points[count++] = {on_grid(point.x), on_grid(point.y), on_grid(point.z)}; }
};

/// Their coordinates, in two vectors each; what is left over is the first point again.
struct Coordinates {
  std::array<Double4, 2> x, y, z;

  WARMFRONT_INLINE explicit Coordinates(const Hull& hull) {
    std::array<std::array<double, 8>, 3> all;
    for (std::size_t i = 0; i < 8; ++i) {
      const Vec3& point = hull.points[i < hull.count ? i : 0];
      all[0][i] = point.x;
      all[1][i] = point.y;
      all[2][i] = point.z;
    }
    for (std::size_t half = 0; half < 2; ++half) {
      x[half] = load<Double4>(all[0].data() + 4 * half);
      y[half] = load<Double4>(all[1].data() + 4 * half);
      z[half] = load<Double4>(all[2].data() + 4 * half);
    }
  }

  // How far all points lie beyond 0 along a direction or its opposite; negative where they do not.
  WARMFRONT_INLINE double kept_along(const Vec3& direction) const {
    const double length = norm(direction);
    if (!(length > 0)) return -std::numeric_limits<double>::infinity();
    const Double4 low = x[0] * direction.x + y[0] * direction.y + z[0] * direction.z;
    const Double4 high = x[1] * direction.x + y[1] * direction.y + z[1] * direction.z;
    const Double4 least = lesser(low, high);
    const Double4 greatest = greater(low, high);
    const double beyond = std::min(std::min(least[0], least[1]), std::min(least[2], least[3]));
    const double before = std::max(std::max(greatest[0], greatest[1]), std::max(greatest[2], greatest[3]));
    return std::max(beyond, -before) / length;
  }
};

// A lower bound of the distance of 0 from the hull. Its nearest point is the nearest point of the span of
// one, two or three of its points, and its direction keeps all points away from 0: so try all of these.
WARMFRONT_TARGET_CLONES
double distance_below(const Hull& hull) {
  const Coordinates all(hull);
  const auto& points = hull.points;
  double most = -std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < hull.count; ++i) {
    const Vec3& a = points[i];
    most = std::max(most, all.kept_along(a));
    for (std::size_t j = i + 1; j < hull.count; ++j) {
      const Vec3 ab = points[j] - a;
      const double square = dot(ab, ab);
      if (square == 0) continue;
      most = std::max(most, all.kept_along(a - (dot(a, ab) / square) * ab));
      for (std::size_t k = j + 1; k < hull.count; ++k)
        most = std::max(most, all.kept_along(cross(ab, points[k] - a)));
    }
  }
  // 0.87 * 2^-24 for rounding to the grid; the remainder far exceeds all other rounding, 2^-48.
  return most - 0x1p-24;
}

}  // namespace

double distance_below(const Query& query, double t) {
  Hull hull;
  for (int k = 0; k < query.gap_count; ++k) hull.add(query.gaps[k].at(t));
  return distance_below(hull);
}

double distance_below(const Query& query, const Window& window) {
  Hull hull;
  for (int k = 0; k < query.gap_count; ++k) {
    hull.add(query.gaps[k].at(window.begin));
    hull.add(query.gaps[k].at(window.end));
  }
  return distance_below(hull);
}

}  // namespace warmfront

// SPDX-License-Identifier: Apache-2.0
#include "engine/elementary/distance_below.h"

#include <algorithm>
#include <array>
#include <limits>
#include <span>

namespace warmfront {
namespace {

// The nearest multiple of 2^-24 to an x in [-1, 1]: sums of these, and products of two, are exact.
double on_grid(double x) {
  return (x + 0x1.8p28) - 0x1.8p28;
}

/// Points on the grid, and the distance of 0 from their hull.
class Hull {
 public:
  void add(const Vec3& point) { points_[count_++] = {on_grid(point.x), on_grid(point.y), on_grid(point.z)}; }

  // A lower bound of the distance of 0. The hull's nearest point is the nearest point of the span of one, two
  // or three of its points, and its direction keeps all points away from 0: so try all of these.
  double distance_below() const {
    double most = -std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < count_; ++i) {
      const Vec3& a = points_[i];
      most = std::max(most, kept_along(a));
      for (std::size_t j = i + 1; j < count_; ++j) {
        const Vec3 ab = points_[j] - a;
        const double square = dot(ab, ab);
        if (square == 0) continue;
        most = std::max(most, kept_along(a - (dot(a, ab) / square) * ab));
        for (std::size_t k = j + 1; k < count_; ++k)
          most = std::max(most, kept_along(cross(ab, points_[k] - a)));
      }
    }
    // 0.87 * 2^-24 for rounding to the grid; the remainder far exceeds all other rounding, 2^-48.
    return most - 0x1p-24;
  }

 private:
  // How far all points lie beyond 0 along a direction or its opposite; negative where they do not.
  double kept_along(const Vec3& direction) const {
    const double length = norm(direction);
    if (!(length > 0)) return -std::numeric_limits<double>::infinity();
    double least = std::numeric_limits<double>::infinity();
    double greatest = -least;
    for (std::size_t i = 0; i < count_; ++i) {
      const double along = dot(direction, points_[i]);
      least = std::min(least, along);
      greatest = std::max(greatest, along);
    }
    return std::max(least, -greatest) / length;
  }

  std::array<Vec3, 8> points_;
  std::size_t count_ = 0;
};

}  // namespace

double distance_below(const Query& query, double t) {
  Hull hull;
  for (int k = 0; k < query.gap_count; ++k) hull.add(query.gaps[k].at(t));
  return hull.distance_below();
}

double distance_below(const Query& query, const Window& window) {
  Hull hull;
  for (int k = 0; k < query.gap_count; ++k) {
    hull.add(query.gaps[k].at(window.begin));
    hull.add(query.gaps[k].at(window.end));
  }
  return hull.distance_below();
}

}  // namespace warmfront

// SPDX-License-Identifier: Apache-2.0
#include "engine/elementary/distance_below.h"

#include <algorithm>
#include <array>
#include <limits>
#include <span>

namespace warmfront {
namespace {

// The nearest multiple of 2^-24, of what is between -1 and 1: sums, and products of two, of such are exact.
double on_grid(double x) {
  return (x + 0x1.8p28) - 0x1.8p28;
}

/// Points of the grid whose hull 0 is far from, or not.
class Hull {
 public:
  void add(const Vec3& point) { points_[count_++] = {on_grid(point.x), on_grid(point.y), on_grid(point.z)}; }

  // The distance of 0, from below. The hull's nearest point is the nearest of what one, two or three of its
  // points span, and lies in the direction that keeps 0 from all of them: so all of these are tried.
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
    // 0.87 for what the grid moves a point by; the rest is far more than all other roundings, of 2^-48.
    return most - 0x1p-24;
  }

 private:
  // How far all points lie beyond 0 along a direction or against it; negative where they do not.
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

// SPDX-License-Identifier: Apache-2.0
#include "engine/broad_phase/separating_direction.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "engine/bounds/bounds_lanes.h"
#include "engine/elementary/vec3.h"

namespace warmfront {
namespace {

constexpr int kMostLooks = 24;

struct Extreme {
  float reach;
  std::uint32_t point;
};

// The least point in a direction.
WARMFRONT_INLINE Extreme least(const MovingPoints& points, int end, const std::array<float, 3>& direction) {
  const float* x = points.lane(end, 0);
  const float* y = points.lane(end, 1);
  const float* z = points.lane(end, 2);
  Float8 reach = Float8{} + std::numeric_limits<float>::max();
  Int8 at{};
  for (std::uint32_t i = 0; i < points.count(); i += 8) {
    const Float8 here = (direction[0] * load<Float8>(x + i) + direction[1] * load<Float8>(y + i)) +
                        direction[2] * load<Float8>(z + i);
    const Int8 less = here < reach;
    reach = select(less, here, reach);
    at = select(less, Int8{} + static_cast<std::int32_t>(i), at);
  }
  int lane = 0;
  for (int k = 1; k < 8; ++k) lane = reach[k] < reach[lane] ? k : lane;
  return {reach[lane], static_cast<std::uint32_t>(at[lane] + lane)};
}

WARMFRONT_INLINE Vec3 point(const MovingPoints& points, int end, std::uint32_t i) {
  return {points.lane(end, 0)[i], points.lane(end, 1)[i], points.lane(end, 2)[i]};
}

// The result of one direction: the least of all differences between a point of b and one of a, at either end.
struct Look {
  double gap;
  Vec3 difference;  // the least one
};

WARMFRONT_TARGET_CLONES
Look look(const MovingPoints& a, const MovingPoints& b, const std::array<Vec3, 2>& offset,
          const Vec3& direction) {
  const std::array<float, 3> along{static_cast<float>(direction.x), static_cast<float>(direction.y),
                                   static_cast<float>(direction.z)};
  const std::array<float, 3> against{-along[0], -along[1], -along[2]};
  Look worst{std::numeric_limits<double>::infinity(), {}};
  for (int end = 0; end < 2; ++end) {
    const Extreme of_a = least(a, end, against);
    const Extreme of_b = least(b, end, along);
    const double gap = dot(Vec3{along[0], along[1], along[2]}, offset[end]) + of_b.reach + of_a.reach;
    if (!(gap >= worst.gap))
      worst = {gap, offset[end] + (point(b, end, of_b.point) - point(a, end, of_a.point))};
  }
  return worst;
}

// Up to four differences, and the point of their hull that is nearest to 0.
class Simplex {
 public:
  // Adds a difference, drops those that do not contribute to the nearest point, and returns that point.
  Vec3 add(const Vec3& difference) {
    points_[count_++] = difference;
    const unsigned newest = 1U << (count_ - 1);
    Vec3 nearest = difference;
    unsigned best = newest;
    double distance = dot(difference, difference);
    for (unsigned subset = newest + 1; subset < 2 * newest; ++subset) {
      Vec3 candidate{};
      if (between(subset, candidate) && dot(candidate, candidate) < distance) {
        nearest = candidate;
        best = subset;
        distance = dot(candidate, candidate);
      }
    }
    // The hull's faces without the newest difference were examined before.
    int kept = 0;
    for (int i = 0; i < count_; ++i) {
      if ((best >> i & 1U) != 0) points_[kept++] = points_[i];
    }
    count_ = kept;
    return nearest;
  }
  bool full() const { return count_ == 4; }

 private:
  // The nearest point to 0 of a subset's span; is it within the subset's hull?
  bool between(unsigned subset, Vec3& nearest) const {
    std::array<Vec3, 4> of{};
    int n = 0;
    for (int i = 0; i < count_; ++i) {
      if ((subset >> i & 1U) != 0) of[n++] = points_[i];
    }
    // Edges from the first point, orthogonalised one by one; the first point's components along them are
    // removed. The weights follow from the triangular system.
    std::array<Vec3, 3> edge{};
    std::array<std::array<double, 3>, 3> shear{};
    std::array<double, 3> weight{};
    nearest = of[0];
    for (int i = 0; i + 1 < n; ++i) {
      edge[i] = of[i + 1] - of[0];
      for (int k = 0; k < i; ++k) {
        shear[k][i] = dot(of[i + 1] - of[0], edge[k]) / dot(edge[k], edge[k]);
        edge[i] = edge[i] - shear[k][i] * edge[k];
      }
      const double square = dot(edge[i], edge[i]);
      if (!(square > 0)) return false;
      weight[i] = -dot(nearest, edge[i]) / square;
      nearest = nearest + weight[i] * edge[i];
    }
    double sum = 0;
    for (int i = n - 2; i >= 0; --i) {
      for (int k = i + 1; k + 1 < n; ++k) weight[i] -= shear[i][k] * weight[k];
      if (!(weight[i] >= 0)) return false;
      sum += weight[i];
    }
    return sum <= 1;
  }

  std::array<Vec3, 4> points_{};
  int count_ = 0;
};

}  // namespace

std::optional<std::array<double, 3>> separating_direction(const MovingPoints& a, const MovingPoints& b,
                                                          const LocalTransform& frame,
                                                          const WantedGap& wanted,
                                                          const std::optional<std::array<double, 3>>& first) {
  std::array<Vec3, 2> offset{};
  double size = 0;
  for (int end = 0; end < 2; ++end) {
    const auto axis = [&](int k) { return frame.to_local(b.centre(end)[k] - a.centre(end)[k]); };
    offset[end] = {axis(0), axis(1), axis(2)};
    size = std::max(size, max_abs(offset[end]));
  }
  const double radii = a.radius() + b.radius();
  size += radii;
  // Three products and sums of float32 coordinates, themselves rounded and turned by rounded matrices, along
  // a direction that is a unit vector up to 2^-22.
  const double slack = 0x1p-19 * radii + 0x1p-21 * size + a.blur() + b.blur();
  const double least_gap = wanted.least + wanted.share_of_size * size + slack;
  if (!(least_gap < std::numeric_limits<double>::infinity())) return std::nullopt;

  // First from centre to centre, which is not a difference of points: centres may lie outside their parts.
  Vec3 nearest = first ? Vec3{(*first)[0], (*first)[1], (*first)[2]} : 0.5 * (offset[0] + offset[1]);
  Simplex simplex;
  for (int looks = 0; looks < kMostLooks; ++looks) {
    const double distance = norm(nearest);
    const Vec3 direction = distance > 0 ? (1 / distance) * nearest : Vec3{1, 0, 0};
    const Look found = look(a, b, offset, direction);
    if (found.gap > least_gap) return std::array{direction.x, direction.y, direction.z};
    // No direction separates the parts by more than the nearest point of the simplex; and when this direction
    // attains that distance, as far as float32 can tell, none is better.
    if (looks > 0 && !(found.gap < distance - slack)) return std::nullopt;
    nearest = simplex.add(found.difference);
    if (simplex.full() || !(norm(nearest) > least_gap)) return std::nullopt;
  }
  return std::nullopt;
}

}  // namespace warmfront

// SPDX-License-Identifier: Apache-2.0
#include "engine/elementary/keep_distance.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>

#include "engine/elementary/closest.h"
#include "engine/elementary/distance_below.h"
#include "engine/motion/longest_way.h"

namespace warmfront {
namespace {

/// The share of the approach that a pair is granted within which its time is found.
constexpr double kOfApproach = 0x1p-7;
/// What may approach by more than this factor times what it and the test's reach do by some time is not
/// reported until then: the direction of the closest points at the start keeps it beyond its own separation
/// by more than that reach, of which the tolerance is kOfApproach of the approach.
constexpr double kSurelyTooFar = 1 + 0x1p-5;
constexpr double kReach = 0x1p-17;
/// Finer than this no window is cut.
constexpr double kFinest = 0x1p-50;

// s / (1 - s), of which every rounding is covered where it is used.
double per_way(double share) {
  return share / (1 - share);
}

// Where both primitives move linearly, their vertices go farthest.
double way_of_any(const VertexMotion* const* first, const VertexMotion* const* end) {
  double way = 0;
  for (; first != end; ++first) way = std::max(way, way_of(**first));
  return way;
}

double widest_of(const FeatureVertices& features, const KeepDistance& keep) {
  const auto* const first = features.vertex.data();
  const auto* const second = first + (features.kind == ContactKind::kVertexFace ? 1 : 2);
  // A way may be longer than double's range.
  const double widest = keep.widest(way_of_any(first, second), way_of_any(second, first + 4));
  return std::min(widest, std::numeric_limits<double>::max());
}

// The normal of the face, or of both edges, at t = 0, from the first primitive towards the second: where the
// closest points lie within both, it is their direction, with less rounding than their difference has.
Vec3 normal_at_start(const Query& query) {
  const Vec3 p1 = query.from0[0].t0;
  const Vec3 p2 = query.from0[1].t0;
  const Vec3 p3 = query.from0[2].t0;
  const Vec3 n = query.kind == ContactKind::kVertexFace ? cross(p2 - p1, p3 - p1) : cross(p1, p3 - p2);
  return dot(n, query.gaps[0].t0) < 0 ? -1 * n : n;
}

bool apart_at_start(const Query& query, const Vec3& closest) {
  const auto separates = [&](const Vec3& direction) {
    const SeparatedTimes separated = separated_times(query, normalised(direction));
    return separated.any && separated.times.begin <= 0;
  };
  return separates(closest) || separates(normal_at_start(query)) ||
         distance_below(query, 0.0) > query.separation * (1 + 0x1p-40) + 0x1p-40;
}

}  // namespace

double KeepDistance::widest(double far_a, double far_b) const {
  const double way = far_a + far_b;
  if (way == 0) return beyond;
  return (beyond + per_way(share) * way) * (1 + 0x1p-48) + 0x1p-1070;  // and for what underflows
}

double farthest_features(const Corners& f, const Corners& g) {
  std::array<std::array<double, 3>, 3> square{};
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j) {
      for (std::size_t k = 0; k < 3; ++k) square[i][j] += (f[i][k] - g[j][k]) * (f[i][k] - g[j][k]);
      if (std::isnan(square[i][j])) return std::numeric_limits<double>::infinity();
    }
  }
  double most = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    const auto& row = square[i];
    const auto& next = square[(i + 1) % 3];
    most = std::max(
        {most, std::min({row[0], row[1], row[2]}), std::min({square[0][i], square[1][i], square[2][i]})});
    for (std::size_t j = 0; j < 3; ++j) {
      const std::size_t k = (j + 1) % 3;
      most = std::max(most, std::min({row[j], row[k], next[j], next[k]}));
    }
  }
  return std::sqrt(most) * (1 + 0x1p-40) + kTooSmall;
}

double starts_apart(const Query& query, const Vec3& closest) {
  double apart = distance_above(closest);
  for (int k = 0; k < query.gap_count; ++k)
    apart = std::min(apart, distance_above(query.gaps[static_cast<std::size_t>(k)].t0));
  return apart;
}

Verdict keep_distance_test(const FeatureVertices& features, const KeepDistance& keep,
                           CertifiedOptions options) {
  Query query = Query::prepare(features, widest_of(features, keep));
  if (query.size == 0) return {true, ContactStatus::kOverlapAtStart, 0};
  const double beyond = query.scaled(keep.beyond);
  // What the two do together is little: each difference of two coordinates is rounded by its own size.
  const double together = beyond + per_way(keep.share) * (query.relative_motion + 0x1p-50);
  query.separation = std::min(query.separation, together * (1 + 0x1p-48));
  Window window;
  if (!trim_by_kdop(query, window)) return {};
  if (query.separation == 0) return certified_search(query, options, window);  // nothing moves
  const Vec3 closest = closest_direction(query, 0);
  const double distance = starts_apart(query, closest);
  const double own = (keep.share * distance + (1 - keep.share) * beyond) * (1 + 0x1p-48);
  query.separation = std::min(query.separation, std::max(own, beyond) + 0x1p-1022);
  const auto approach_of = [&](double from) { return (1 - keep.share) * std::max(0.0, from - beyond); };
  const double approach = approach_of(distance);
  const double by_then = (query.relative_motion * options.latest + kReach) * kSurelyTooFar;
  if (approach > by_then && approach_of(distance_below(query, 0.0)) > by_then) return {};
  if (!trim_by_kdop(query, window)) return {};
  options.tolerance = std::min(options.tolerance, std::max(kFinest, kOfApproach * approach / query.size));
  if (window.begin == 0 && !apart_at_start(query, closest)) return {true, ContactStatus::kOverlapAtStart, 0};
  return certified_search(query, options, window);
}

}  // namespace warmfront

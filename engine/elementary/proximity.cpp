// SPDX-License-Identifier: Apache-2.0
#include "engine/elementary/proximity.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <span>

#include "engine/elementary/closest.h"
#include "engine/elementary/distance_below.h"
#include "engine/elementary/exact.h"
#include "engine/elementary/exact_near.h"

namespace warmfront {
namespace {

// The primitives as they stand at an instant, as a motion that does not move.
class Standing {
 public:
  Standing(const FeatureVertices& features, Instant at) : features_{features.kind, {}} {
    for (std::size_t k = 0; k < 4; ++k) {
      const VertexMotion& vertex = *features.vertex[k];
      vertices_[k].t0 = vertices_[k].t1 = at == Instant::kStart ? vertex.t0 : vertex.t1;
      features_.vertex[k] = &vertices_[k];
    }
  }
  Standing(const Standing&) = delete;
  Standing& operator=(const Standing&) = delete;

  const FeatureVertices& features() const { return features_; }

 private:
  std::array<VertexMotion, 4> vertices_;
  FeatureVertices features_;
};

// Is the origin kept beyond the separation from the polygon of differences by the direction to the nearest
// point of its sides, or by its normal? These come from differences of coordinates alone: where two corners
// nearly touch, the closest points of two edges are off by as much as they are apart.
bool kept_apart(const Query& query) {
  constexpr std::array<std::size_t, 3> kVertexFace{0, 1, 2};
  constexpr std::array<std::size_t, 4> kEdgeEdge{0, 1, 3, 2};
  const bool of_face = query.kind == ContactKind::kVertexFace;
  const std::span<const std::size_t> corners =
      of_face ? std::span<const std::size_t>(kVertexFace) : std::span<const std::size_t>(kEdgeEdge);
  const auto corner = [&](std::size_t k) { return query.gaps[corners[k % corners.size()]].t0; };
  Vec3 nearest{};
  for (std::size_t k = 0; k < corners.size(); ++k) {
    const Vec3 point = closest_on_segment(corner(k), corner(k + 1));
    if (k == 0 || dot(point, point) < dot(nearest, nearest)) nearest = point;
  }
  Vec3 normal = cross(corner(1) - corner(0), corner(2) - corner(1));
  if (dot(normal, corner(0)) < 0) normal = -1.0 * normal;
  const double beyond = query.separation * (1 + 0x1p-40);
  return kept_along(query, normalised(nearest)) > beyond || kept_along(query, normalised(normal)) > beyond;
}

enum class Near { kNo, kYes, kUnknown };

// What doubles tell.
Near nearness(const Query& query, double reach) {
  if (query.size == 0) return Near::kYes;
  Window window;
  if (!trim_by_kdop(query, window)) return Near::kNo;
  const Vec3 closest = closest_direction(query, 0);
  // From points that are in the primitives up to 2^-44.
  if (norm(closest) * (1 + 0x1p-50) + 0x1p-44 <= query.separation * (1 - 0x1p-48)) return Near::kYes;
  if (separated_times(query, normalised(closest)).any) return Near::kNo;
  if (kept_apart(query)) return Near::kNo;
  return distance_below(query, 0) > query.separation * (1 + 0x1p-40) + reach ? Near::kNo : Near::kUnknown;
}

}  // namespace

double least_distance(const FeatureVertices& given, Instant at, double most) {
  const Standing standing(given, at);
  const Query query = Query::prepare(standing.features(), most);
  if (query.size == 0) return 0;
  const double below =
      std::max({0.0, distance_below(query, 0), kept_along(query, normalised(closest_direction(query, 0)))});
  return std::min(most, query.unscaled(below));
}

Verdict proximity_test(const FeatureVertices& features, Instant at, const ElementaryOptions& options,
                       ElementaryCounts& counts) {
  // Nearer than this beyond the distance, for a pair of size 1, distance_below() may not tell.
  constexpr double kReach = 0x1p-21;
  const double toi = at == Instant::kStart ? 0 : 1;
  const Standing standing(features, at);
  const Query query = Query::prepare(standing.features(), options.min_separation);
  const Near near = nearness(query, options.tier == Tier::kExact ? 0 : kReach);
  if (near == Near::kNo) return {};
  if (near == Near::kYes) return {true, ContactStatus::kHit, toi};
  if (options.tier != Tier::kExact) return {true, ContactStatus::kPossible, toi};
  const Verdict exact =
      options.min_separation > 0
          ? exact_near_test(standing.features(), options.min_separation, 1, counts.exact_tests)
          : exact_test(standing.features(), 1, counts.exact_tests);
  return exact.contact ? Verdict{true, ContactStatus::kHit, toi} : Verdict{};
}

}  // namespace warmfront

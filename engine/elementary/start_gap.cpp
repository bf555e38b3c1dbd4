// SPDX-License-Identifier: Apache-2.0
#include "engine/elementary/start_gap.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "engine/elementary/certified.h"
#include "engine/elementary/closest.h"
#include "engine/elementary/proximity.h"
#include "engine/options.h"

namespace warmfront {
namespace {

// What of a direction is orthogonal to an edge: by how little the points at its ends differ along it, it is
// as exact as if the closest points were not rounded.
Vec3 across(const Vec3& direction, const Vec3& edge) {
  const double squared = dot(edge, edge);
  return squared > 0 ? direction - (dot(direction, edge) / squared) * edge : direction;
}

// A normal, towards a gap.
Vec3 towards(const Vec3& normal, const Vec3& gap) {
  return dot(normal, gap) < 0 ? -1 * normal : normal;
}

Vec3 of_vertex_and_face(const std::array<Vec3, 3>& corners, const Vec3& closest) {
  const TrianglePoint at = closest_in_triangle(corners[0], corners[1], corners[2]);
  if (at.from == at.to) return towards(cross(corners[1] - corners[0], corners[2] - corners[0]), corners[0]);
  const bool within = at.share > 0 && at.share < 1;
  return within ? across(closest, corners[static_cast<std::size_t>(at.to)] -
                                      corners[static_cast<std::size_t>(at.from)])
                : closest;
}

Vec3 of_edges(const Vec3& first, const Vec3& gap, const Vec3& second, const Vec3& closest) {
  const auto [s, r] = closest_shares(first, gap, gap + second);
  const bool within_first = s > 0 && s < 1;
  const bool within_second = r > 0 && r < 1;
  if (within_first && within_second) return towards(cross(first, second), gap);
  if (within_first) return across(closest, first);
  return within_second ? across(closest, second) : closest;
}

// Between the closest points at t = 0.
Vec3 start_direction(const Query& query) {
  const std::array<Vec3, 3> p{query.from0[0].t0, query.from0[1].t0, query.from0[2].t0};
  const Vec3 closest = closest_direction(query, 0);
  return normalised(query.kind == ContactKind::kVertexFace ? of_vertex_and_face(p, closest)
                                                           : of_edges(p[0], p[1], p[2] - p[1], closest));
}

}  // namespace

StartGap start_gap(const FeatureVertices& features, double most) {
  const Query query = Query::prepare(features, 0);
  if (query.size == 0) return {};
  const double along =
      std::min(most, query.unscaled(std::max(0.0, kept_along(query, start_direction(query)))));
  return {std::max(along, least_distance(features, Instant::kStart, most)), query.unscaled(query.size)};
}

StartGap start_gap(const VertexMotion& vertex, const HalfSpaceMotion& half_space) {
  double size = 0;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    size = std::max({size, std::fabs(vertex.t0[axis] - half_space.point[0][axis]),
                     std::fabs(vertex.t1[axis] - half_space.point[1][axis])});
  }
  return {half_space_distance(vertex, half_space, Instant::kStart), size};
}

bool stays_apart(const FeatureVertices& features, double separation) {
  const Query query = Query::prepare(features, separation);
  if (query.size == 0) return false;
  const SeparatedTimes separated = separated_times(query, start_direction(query));
  return separated.any && separated.times.begin <= 0 && separated.times.end >= 1;
}

bool is_within(const FeatureVertices& features, double separation) {
  const Query query = Query::prepare(features, separation);
  return query.size > 0 && std::ranges::any_of(std::array{1.0, 0.5, 0.25, 0.125}, [&](double t) {
           return distance_above(closest_direction(query, t)) <= query.separation * (1 - 0x1p-48);
         });
}

}  // namespace warmfront

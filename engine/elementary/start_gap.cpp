// SPDX-License-Identifier: Apache-2.0
#include "engine/elementary/start_gap.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <optional>

#include "engine/elementary/certified.h"
#include "engine/elementary/closest.h"
#include "engine/elementary/elementary_test.h"
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

using Numbers = std::array<double, 3>;

Numbers numbers_of(const Vec3& v) {
  return {v.x, v.y, v.z};
}

// How much nearer along a direction a vertex may be than at its start, wherever in its box it is; `sense` 1
// where nearer is less.
double least_along(const Numbers& direction, const VertexMotion& vertex, double sense) {
  double least = 0;
  for (std::size_t axis = 0; axis < 3; ++axis)
    least += std::min(0.0, sense * direction[axis] * (vertex.t1[axis] - vertex.t0[axis]));
  return least;
}

double size_of(const VertexMotion& vertex) {
  double size = 0;
  for (std::size_t axis = 0; axis < 3; ++axis)
    size = std::max({size, std::fabs(vertex.t0[axis]), std::fabs(vertex.t1[axis])});
  return size;
}

// Of a direction whose largest coordinate is at most 1: all roundings of what is along it, and 2^-50 a
// coordinate of either side.
double margin(double size) {
  return 0x1p-46 * size;
}

// A vertex at its start, and a half-space that does not move.
struct AlongNormal {
  Numbers normal{};  ///< its largest coordinate is 1
  double gap = 0;    ///< below 0 inside
  double size = 0;
};

std::optional<AlongNormal> along_normal(const VertexMotion& vertex, const HalfSpaceMotion& half_space) {
  if (half_space.moves()) return std::nullopt;
  const Numbers& normal = half_space.normal[0];
  const double largest = std::max({std::fabs(normal[0]), std::fabs(normal[1]), std::fabs(normal[2])});
  if (!(largest > 0x1p-900) || !(largest < 0x1p900)) return std::nullopt;
  AlongNormal along{.size = size_of(vertex)};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    along.normal[axis] = normal[axis] / largest;
    along.gap += along.normal[axis] * (vertex.t0[axis] - half_space.point[0][axis]);
    along.size = std::max(along.size, std::fabs(half_space.point[0][axis]));
  }
  return along;
}

double held(double size) {
  return std::min(size, std::numeric_limits<double>::max() / 16);
}

}  // namespace

double pair_size(const FeatureVertices& features) {
  const std::size_t of_first = features.kind == ContactKind::kVertexFace ? 1 : 2;
  double size = 0;
  for (const auto end : {&VertexMotion::t0, &VertexMotion::t1}) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto at = [&](std::size_t k) { return (features.vertex[k]->*end)[axis]; };
      for (std::size_t i = 0; i < of_first; ++i) {
        for (std::size_t j = of_first; j < 4; ++j) size = std::max(size, std::fabs(at(j) - at(i)));
      }
    }
  }
  return held(size);
}

double pair_size(const VertexMotion& vertex, const HalfSpaceMotion& half_space) {
  double size = 0;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    size = std::max({size, std::fabs(vertex.t0[axis] - half_space.point[0][axis]),
                     std::fabs(vertex.t1[axis] - half_space.point[1][axis])});
  }
  return held(size);
}

StartGap start_gap(const FeatureVertices& features, double most) {
  const Query query = Query::prepare(features, 0);
  if (query.size == 0) return {};
  const double along =
      std::min(most, query.unscaled(std::max(0.0, kept_along(query, start_direction(query)))));
  return {std::max(along, least_distance(features, Instant::kStart, most)), pair_size(features)};
}

StartGap start_gap(const VertexMotion& vertex, const HalfSpaceMotion& half_space) {
  return {half_space_distance(vertex, half_space, Instant::kStart), pair_size(vertex, half_space)};
}

bool starts_within(const FeatureVertices& features, double separation, ElementaryCounts& counts) {
  const ElementaryOptions exact{.tier = Tier::kExact, .min_separation = separation};
  return proximity_test(features, Instant::kStart, exact, counts).contact;
}

bool starts_within(const VertexMotion& vertex, const HalfSpaceMotion& half_space, double separation,
                   ElementaryCounts& counts) {
  const ElementaryOptions exact{.tier = Tier::kExact, .min_separation = separation};
  return half_space_proximity(vertex, half_space, Instant::kStart, exact, counts).contact;
}

bool comes_within(const FeatureVertices& features, double separation, ElementaryCounts& counts) {
  const Query query = Query::prepare(features, separation);
  if (query.size == 0) return true;
  const SeparatedTimes separated = separated_times(query, start_direction(query));
  if (separated.any && separated.times.begin <= 0 && separated.times.end >= 1) return false;
  for (const double t : {1.0, 0.5, 0.25, 0.125}) {
    if (distance_above(closest_direction(query, t)) <= query.separation * (1 - 0x1p-48)) return true;
  }
  return elementary_test(features, {.tier = Tier::kExact, .min_separation = separation}, counts).contact;
}

bool comes_within(const VertexMotion& vertex, const HalfSpaceMotion& half_space, double separation,
                  ElementaryCounts& counts) {
  const ElementaryOptions exact{.tier = Tier::kExact, .min_separation = separation};
  return half_space_test(vertex, half_space, exact, counts).contact;
}

bool keeps_its_side(const FeatureVertices& features) {
  const Query query = Query::prepare(features, 0);
  if (query.size == 0) return false;
  const Vec3 direction = start_direction(query);
  const Numbers along = numbers_of(direction);
  const std::size_t of_first = features.kind == ContactKind::kVertexFace ? 1 : 2;
  double first = 0, second = 0, size = 0;
  for (std::size_t k = 0; k < 4; ++k) {
    double& side = k < of_first ? first : second;
    side = std::min(side, least_along(along, *features.vertex[k], k < of_first ? -1 : 1));
    size = std::max(size, size_of(*features.vertex[k]));
  }
  const double gap = query.unscaled(std::max(0.0, kept_along(query, direction))) * max_abs(direction);
  return gap + first + second > margin(size);
}

bool keeps_its_side(const VertexMotion& vertex, const HalfSpaceMotion& half_space) {
  const std::optional<AlongNormal> along = along_normal(vertex, half_space);
  return along && along->gap + least_along(along->normal, vertex, 1) > margin(along->size);
}

bool parts_by_axis(const FeatureVertices& features) {
  const std::size_t of_first = features.kind == ContactKind::kVertexFace ? 1 : 2;
  const auto all = [&](const auto& in_order) {
    for (std::size_t i = 0; i < of_first; ++i) {
      for (std::size_t j = of_first; j < 4; ++j)
        if (!in_order(*features.vertex[i], *features.vertex[j])) return false;
    }
    return true;
  };
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto parts = [axis](const VertexMotion& below, const VertexMotion& above) {
      return below.t1[axis] <= below.t0[axis] && below.t0[axis] < above.t0[axis] &&
             above.t0[axis] <= above.t1[axis];
    };
    if (all(parts) || all([&](const auto& a, const auto& b) { return parts(b, a); })) return true;
  }
  return false;
}

bool goes_with_normal(const VertexMotion& vertex, const HalfSpaceMotion& half_space) {
  if (half_space.moves()) return false;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double x = half_space.normal[0][axis], from = vertex.t0[axis], to = vertex.t1[axis];
    if ((x > 0 && to < from) || (x < 0 && to > from)) return false;
  }
  return true;
}

bool is_inside_and_goes_no_deeper(const VertexMotion& vertex, const HalfSpaceMotion& half_space) {
  const std::optional<AlongNormal> along = along_normal(vertex, half_space);
  if (!along || along->gap > -margin(along->size)) return false;
  double further = 0;
  for (std::size_t axis = 0; axis < 3; ++axis)
    further += along->normal[axis] * (vertex.t1[axis] - vertex.t0[axis]);
  return further > -margin(along->size);
}

}  // namespace warmfront

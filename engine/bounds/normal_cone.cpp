// SPDX-License-Identifier: Apache-2.0
#include "engine/bounds/normal_cone.h"

#include <algorithm>

#include "engine/elementary/vec3.h"

namespace warmfront {
namespace {

Vec3 vec(const std::array<double, 4>& x) {
  return {x[0], x[1], x[2]};
}

MovingVec3 between(const VertexMotion& from, const VertexMotion& to) {
  return {vec(to.t0) - vec(from.t0), vec(to.t1) - vec(from.t1)};
}

double largest(const MovingVec3& v) {
  return std::max(max_abs(v.t0), max_abs(v.t1));
}

// Is (p x q).axis certainly positive at all times?
bool turns_left(const MovingVec3& p, const MovingVec3& q, const Vec3& axis) {
  const double bound = 64 * kUnit * largest(p) * largest(q) + 0x1p-900;
  return dot(cross(p.t0, q.t0), axis) > bound && dot(cross(p.t1, q.t1), axis) > bound &&
         0.5 * (dot(cross(p.t0, q.t1), axis) + dot(cross(p.t1, q.t0), axis)) > bound;
}

struct Sides {
  MovingVec3 e;
  MovingVec3 g;
};

Sides sides(const Face& face, std::span<const VertexMotion> vertices) {
  return {between(vertices[face[0]], vertices[face[1]]), between(vertices[face[0]], vertices[face[2]])};
}

// The sum of the normals at both ends of the step, scaled to a largest coordinate of 1, or zero. The proof
// holds for any axis.
Vec3 choose_axis(const Scene& scene, std::span<const VertexMotion> vertices,
                 std::span<const std::uint32_t> patch) {
  Vec3 sum{0, 0, 0};
  for (const std::uint32_t f : patch) {
    const auto [e, g] = sides(scene.faces()[f], vertices);
    sum = sum + cross(e.t0, g.t0) + cross(e.t1, g.t1);
  }
  const double largest = max_abs(sum);
  return largest > 0x1p-900 && largest < 0x1p900 ? (1 / largest) * sum : Vec3{0, 0, 0};
}

bool contour_is_simple(std::span<const VertexMotion> vertices, std::span<const std::uint32_t> contour,
                       const Vec3& axis) {
  VertexMotion centre{};
  for (int k = 0; k < 3; ++k) {
    for (const std::uint32_t v : contour) {
      centre.t0[k] += vertices[v].t0[k];
      centre.t1[k] += vertices[v].t1[k];
    }
    centre.t0[k] /= static_cast<double>(contour.size());
    centre.t1[k] /= static_cast<double>(contour.size());
  }
  // `across` is exactly perpendicular to the axis: the ray in the plane normal to both starts where the sign
  // of a point's component along it changes. Each edge turns left by less than half a turn, so it crosses the
  // ray from below to above exactly when its ends are below and above: the number of crossings is the winding
  // number.
  const Vec3 across =
      std::fabs(axis.x) < std::fabs(axis.y) ? Vec3{0, axis.z, -axis.y} : Vec3{-axis.z, 0, axis.x};
  const auto side = [&](const MovingVec3& p) {
    const double height = dot(p.t0, across);
    if (std::fabs(height) <= 16 * kUnit * max_abs(p.t0) + 0x1p-900) return 0;
    return height > 0 ? 1 : -1;
  };
  int windings = 0;
  MovingVec3 a = between(centre, vertices[contour.back()]);
  for (const std::uint32_t v : contour) {
    const MovingVec3 b = between(centre, vertices[v]);
    if (!turns_left(a, b, axis) || side(b) == 0) return false;
    windings += side(a) < 0 && side(b) > 0;
    a = b;
  }
  return windings == 1;
}

}  // namespace

bool provably_embedded(const Scene& scene, std::span<const VertexMotion> vertices,
                       std::span<const std::uint32_t> patch, std::span<const std::uint32_t> contour) {
  const Vec3 axis = choose_axis(scene, vertices, patch);
  if (!(max_abs(axis) > 0.5)) return false;  // no usable normals
  const bool graph = std::ranges::all_of(patch, [&](std::uint32_t f) {
    const auto [e, g] = sides(scene.faces()[f], vertices);
    return turns_left(e, g, axis);
  });
  return graph && contour_is_simple(vertices, contour, axis);
}

}  // namespace warmfront

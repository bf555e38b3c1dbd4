// SPDX-License-Identifier: Apache-2.0
#include "engine/elementary/contact_geometry.h"

#include <algorithm>
#include <cmath>

#include "engine/elementary/closest.h"

namespace warmfront {
namespace {

Vec3 at(const VertexMotion& vertex, double t) {
  return lerp({vertex.t0[0], vertex.t0[1], vertex.t0[2]}, {vertex.t1[0], vertex.t1[1], vertex.t1[2]}, t);
}

// The parameter of q, a point of the segment from a to b.
double share(const Vec3& q, const Vec3& a, const Vec3& b) {
  const Vec3 ab = b - a;
  const double length = dot(ab, ab);
  return length > 0 ? std::clamp(dot(q - a, ab) / length, 0.0, 1.0) : 0.0;
}

// The barycentric coordinates of q, a point of the triangle (a, b, c).
std::array<double, 3> barycentric(const Vec3& q, const Vec3& a, const Vec3& b, const Vec3& c) {
  const Vec3 n = cross(b - a, c - a);
  const double area = dot(n, n);
  if (!(area > 0x1p-80 * dot(b - a, b - a) * dot(c - a, c - a))) {  // a needle: use its longest edge
    const double ab = dot(b - a, b - a), bc = dot(c - b, c - b), ca = dot(a - c, a - c);
    if (ab >= bc && ab >= ca) return {1 - share(q, a, b), share(q, a, b), 0};
    if (bc >= ca) return {0, 1 - share(q, b, c), share(q, b, c)};
    return {share(q, c, a), 0, 1 - share(q, c, a)};
  }
  std::array<double, 3> weights{dot(cross(c - b, q - b), n) / area, dot(cross(a - c, q - c), n) / area,
                                dot(cross(b - a, q - a), n) / area};
  for (double& weight : weights) weight = std::clamp(weight, 0.0, 1.0);
  const double sum = weights[0] + weights[1] + weights[2];
  for (double& weight : weights) weight /= sum;
  return weights;
}

// Scaled by a power of two to a largest coordinate in [1/2, 1): products of up to four of them would
// otherwise overflow or underflow in large or small scenes.
template <std::size_t N>
std::array<Vec3, N> near_one(std::array<Vec3, N> vectors) {
  double largest = 0;
  for (const Vec3& v : vectors) largest = std::max(largest, max_abs(v));
  int exponent = 0;
  std::frexp(largest, &exponent);
  for (Vec3& v : vectors)
    v = {std::ldexp(v.x, -exponent), std::ldexp(v.y, -exponent), std::ldexp(v.z, -exponent)};
  return vectors;
}

// The vertices relative to the first one. Scaled first, since differences may overflow.
std::array<Vec3, 4> from_first(const std::array<Vec3, 4>& vertices) {
  std::array<Vec3, 4> x = near_one(vertices);
  for (std::size_t k = 4; k-- > 0;) x[k] = x[k] - x[0];
  return near_one(x);
}

Vec3 unit(const Vec3& direction) {
  const Vec3 scaled = normalised(near_one(std::array{direction})[0]);
  const double length = norm(scaled);
  return length > 0 ? (1 / length) * scaled : Vec3{0, 0, 0};
}

}  // namespace

ContactGeometry contact_geometry(ContactKind kind, std::span<const VertexMotion* const, 4> vertices,
                                 double toi) {
  ContactGeometry geometry;
  std::array<Vec3, 4> x;
  for (int k = 0; k < 4; ++k) x[k] = at(*vertices[k], toi);
  x = from_first(x);
  auto& w = geometry.weights;
  const int of_a = kind == ContactKind::kVertexFace ? 1 : 2;  // vertices of the first feature
  Vec3 normal;
  if (kind == ContactKind::kVertexFace) {
    const auto face = barycentric(closest_on_triangle(x[1], x[2], x[3]), x[1], x[2], x[3]);
    w = {1, face[0], face[1], face[2]};
    normal = cross(x[2] - x[1], x[3] - x[1]);
  } else {
    const auto [s, r] = closest_shares(x[1], x[2], x[3]);
    w = {1 - s, s, 1 - r, r};
    normal = cross(x[1], x[3] - x[2]);
  }
  const auto point = [&](int from, int to, double t) {
    Vec3 sum{0, 0, 0};
    for (int k = from; k < to; ++k) sum = sum + w[k] * at(*vertices[k], t);
    return sum;
  };
  const Vec3 a = point(0, of_a, toi);
  const Vec3 b = point(of_a, 4, toi);
  const Vec3 from = point(0, of_a, 0) - point(of_a, 4, 0);
  Vec3 direction = unit(normal);
  if (max_abs(direction) == 0) direction = unit(from);
  if (dot(direction, from) < 0) direction = -1.0 * direction;
  geometry.normal = {direction.x, direction.y, direction.z};
  geometry.points = {a.x, a.y, a.z, b.x, b.y, b.z};
  return geometry;
}

}  // namespace warmfront

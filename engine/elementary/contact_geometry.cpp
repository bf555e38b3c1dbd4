// SPDX-License-Identifier: Apache-2.0
#include "engine/elementary/contact_geometry.h"

#include <algorithm>
#include <cmath>

#include "engine/elementary/closest.h"
#include "engine/elementary/powers_of_two.h"

namespace warmfront {
namespace {

Vec3 at(const VertexMotion& vertex, double t) {
  return lerp({vertex.t0[0], vertex.t0[1], vertex.t0[2]}, {vertex.t1[0], vertex.t1[1], vertex.t1[2]}, t);
}

// Scaled by a power of two to a largest coordinate in [1/2, 1): products of up to four of them would
// otherwise overflow or underflow in large or small scenes.
template <std::size_t N>
std::array<Vec3, N> near_one(std::array<Vec3, N> vectors, int& exponent) {
  double largest = 0;
  for (const Vec3& v : vectors) largest = std::max(largest, max_abs(v));
  exponent = largest > 0 ? exponent_of(largest) : 0;
  // A product with a power of two is rounded as ldexp() is, in a fraction of its time.
  if (-exponent >= kLeastPower && -exponent <= kMostPower) {
    const double scale = power_of_two(-exponent);
    for (Vec3& v : vectors) v = scale * v;
  } else {
    for (Vec3& v : vectors)
      v = {std::ldexp(v.x, -exponent), std::ldexp(v.y, -exponent), std::ldexp(v.z, -exponent)};
  }
  return vectors;
}

// The vertices relative to the first one, times a power of two. Scaled first, since differences may overflow.
struct FromFirst {
  std::array<Vec3, 4> x;
  int exponent;  // x is 2^-exponent of the differences
};
FromFirst from_first(const std::array<Vec3, 4>& vertices) {
  int first = 0;
  std::array<Vec3, 4> x = near_one(vertices, first);
  for (std::size_t k = 4; k-- > 0;) x[k] = x[k] - x[0];
  int second = 0;
  return {near_one(x, second), first + second};
}

Vec3 unit(const Vec3& direction) {
  int exponent = 0;
  const Vec3 scaled = normalised(near_one(std::array{direction}, exponent)[0]);
  const double length = norm(scaled);
  return length > 0 ? (1 / length) * scaled : Vec3{0, 0, 0};
}

std::array<Vec3, 4> places_at(std::span<const VertexMotion* const, 4> vertices, double toi) {
  std::array<Vec3, 4> places;
  for (int k = 0; k < 4; ++k) places[k] = at(*vertices[k], toi);
  return places;
}

// Of vertices that are relative to the first.
std::array<double, 4> weights_of(ContactKind kind, const std::array<Vec3, 4>& x) {
  if (kind == ContactKind::kVertexFace) {
    const auto face = closest_weights(x[1], x[2], x[3]);
    return {1, face[0], face[1], face[2]};
  }
  const auto [s, r] = closest_shares(x[1], x[2], x[3]);
  return {1 - s, s, 1 - r, r};
}

bool nearly_parallel(const Vec3& a, const Vec3& b) {
  int ignored = 0;
  const Vec3 p = near_one(std::array{a}, ignored)[0];
  const Vec3 q = near_one(std::array{b}, ignored)[0];
  const Vec3 n = cross(p, q);
  return dot(n, n) < 1e-3 * dot(p, p) * dot(q, q);
}

ClosestFeatures closest_features(ContactKind kind, const std::array<double, 4>& weights) {
  if (kind == ContactKind::kVertexFace) {
    switch (std::count(weights.begin() + 1, weights.end(), 0.0)) {
      case 0:
        return ClosestFeatures::kFaceVertex;
      case 1:
        return ClosestFeatures::kEdgeVertex;
      default:
        return ClosestFeatures::kVertexVertex;
    }
  }
  switch (std::ranges::count(weights, 0.0)) {
    case 0:
      return ClosestFeatures::kEdgeEdge;
    case 1:
      return ClosestFeatures::kEdgeVertex;
    default:
      return ClosestFeatures::kVertexVertex;
  }
}

}  // namespace

ClosestPlace closest_place(ContactKind kind, std::span<const VertexMotion* const, 4> vertices, double toi) {
  const std::array<Vec3, 4> x = from_first(places_at(vertices, toi)).x;
  return {weights_of(kind, x), kind == ContactKind::kEdgeEdge && nearly_parallel(x[1], x[3] - x[2])};
}

ContactGeometry contact_geometry(ContactKind kind, std::span<const VertexMotion* const, 4> vertices,
                                 double toi) {
  ContactGeometry geometry;
  const std::array<Vec3, 4> at_toi = places_at(vertices, toi);
  const auto [x, exponent] = from_first(at_toi);
  auto& w = geometry.weights;
  const int of_a = kind == ContactKind::kVertexFace ? 1 : 2;  // vertices of the first feature
  w = weights_of(kind, x);
  const Vec3 normal =
      kind == ContactKind::kVertexFace ? cross(x[2] - x[1], x[3] - x[1]) : cross(x[1], x[3] - x[2]);
  geometry.closest = closest_features(kind, w);
  const auto sum = [&](int from, int to, const auto& of) {
    Vec3 total{0, 0, 0};
    for (int k = from; k < to; ++k) total = total + w[k] * of(k);
    return total;
  };
  const auto in_scene = [&](int k) { return at_toi[k]; };
  const auto in_scene_at_start = [&](int k) { return at(*vertices[k], 0); };
  const auto scaled = [&, &y = x](int k) { return y[k]; };
  const Vec3 a = sum(0, of_a, in_scene);
  const Vec3 b = sum(of_a, 4, in_scene);
  const Vec3 apart = sum(0, of_a, scaled) - sum(of_a, 4, scaled);
  const Vec3 from = sum(0, of_a, in_scene_at_start) - sum(of_a, 4, in_scene_at_start);
  Vec3 towards = unit(normal);
  if (max_abs(towards) == 0) towards = unit(from);
  if (dot(towards, from) < 0) towards = -1.0 * towards;
  const Vec3 direction = unit(apart);
  geometry.normal = {towards.x, towards.y, towards.z};
  geometry.points = {a.x, a.y, a.z, b.x, b.y, b.z};
  geometry.direction = {direction.x, direction.y, direction.z};
  geometry.squared_distance = std::ldexp(dot(apart, apart), 2 * exponent);
  return geometry;
}

}  // namespace warmfront

// SPDX-License-Identifier: Apache-2.0
// The stage before the elementary test of proximity: see proximity_filter.h.
#include "engine/narrow_phase/proximity_filter.h"

#include <algorithm>
#include <cstddef>

#include "engine/narrow_phase/difference_polygons.h"
#include "engine/simd/lanes3.h"
#include "engine/simd/target_clones.h"

namespace warmfront {
namespace {

using namespace difference_polygons;  // NOLINT: what this filter works on

WARMFRONT_INLINE Four3 select(const Mask& mask, const Four3& a, const Four3& b) {
  return {warmfront::select(mask, a.x, b.x), warmfront::select(mask, a.y, b.y),
          warmfront::select(mask, a.z, b.z)};
}
WARMFRONT_INLINE Four3 operator*(const Lanes& s, const Four3& v) {
  return {s * v.x, s * v.y, s * v.z};
}

/// A point of the polygon near the one closest to the origin, and the square of its length.
struct Closest {
  Four3 point;
  Lanes squared;

  WARMFRONT_INLINE void take(const Four3& other, const Mask& where) {
    const Lanes length = dot(other, other);
    const Mask nearer = where & (length < squared);
    point = select(nearer, other, point);
    squared = warmfront::select(nearer, length, squared);
  }
};

WARMFRONT_INLINE Closest closest_to_origin(const Corners& p, const Mask& is_triangle) {
  Closest closest{p[0], dot(p[0], p[0])};
  for (int k = 0; k < 4; ++k) {
    const Four3& begin = p[k];
    const Four3 side = p[(k + 1) % 4] - begin;
    const Lanes length = dot(side, side);
    const Lanes share = warmfront::select(length > 0, -dot(begin, side) / length, Lanes{});
    // In [0, 1], whatever it was.
    closest.take(begin + greater(lesser(share, Lanes{} + 1), Lanes{}) * side, Mask{} - 1);
  }
  // Inside: p[0] + s u + t v.
  const Four3 u = p[1] - p[0];
  const Four3 v = select(is_triangle, p[2], p[3]) - p[0];
  const Lanes uu = dot(u, u), uv = dot(u, v), vv = dot(v, v);
  const Lanes pu = dot(p[0], u), pv = dot(p[0], v);
  const Lanes determinant = uu * vv - uv * uv;
  const Lanes s = (uv * pv - vv * pu) / determinant;
  const Lanes t = (uv * pu - uu * pv) / determinant;
  const Lanes most = warmfront::select(is_triangle, s + t, greater(s, t));
  closest.take(p[0] + s * u + t * v, (determinant > 0) & (s >= 0) & (t >= 0) & (most <= 1));
  return closest;
}

// Error bounds, with u = 2^-53 and M the largest coordinate of the corners as computed, which have one
// rounding. Products of four coordinates neither overflow nor underflow for M within 2^200 and 2^-200.
//
// Near: with the weights as doubles, which sum to 1 within u, there is a point of the true polygon whose
// coordinates differ from the point's by the errors of three corners (3 u M), of two differences (4 u M), of
// two products (4 u M), of two sums (8 u M) and of the weights' sum (2 u M): by 40 u M in all, as lengths.
// The square of the length is off by a few u of itself.
//
// Apart: the point is a direction that keeps all corners beyond the separation. A dot product is off by less
// than 4 u M |w|_1 <= 7 u M |w|, the corners' own rounding included, its square by u of itself.
//
// 128 u M are granted, and 128 u of squares.
template <class PlaceOf>
WARMFRONT_INLINE void decide(const FeaturePair* const (&pairs)[kLanes], const PlaceOf& place_of,
                             const Lanes& asked, double excess, unsigned& near, unsigned& apart) {
  constexpr double kError = 0x1p-46;
  Corners p;
  gather(pairs, place_of, p);
  std::array<long long, kLanes> triangles;
  for (std::size_t i = 0; i < kLanes; ++i) triangles[i] = pairs[i]->kind == ContactKind::kVertexFace ? -1 : 0;
  const auto is_triangle = load<Mask>(triangles.data());
  const Closest closest = closest_to_origin(p, is_triangle);
  const Lanes size = size_of(p);
  const Lanes error = kError * size;
  const Lanes separation = asked + excess * size;
  const Mask in_range = (size > 0x1p-200) & (size < 0x1p200);
  const Lanes squared = closest.squared * (1 + kError);

  const Lanes within = separation - error;
  near = bits_of(in_range & (within > 0) & (squared <= within * within));

  Lanes least = dot(closest.point, p[0]);
  for (int k = 1; k < 4; ++k) least = lesser(least, dot(closest.point, p[k]));
  const Lanes beyond = separation + error;
  apart = bits_of(in_range & (least > 0) & (least * least > squared * (beyond * beyond)));
}

template <class PlaceOf, class SeparationOf>
WARMFRONT_INLINE void filter(std::span<const FeaturePair> pairs, const PlaceOf& place_of,
                             const SeparationOf& separation_of, double excess, Nearness* nearness) {
  for (std::size_t first = 0; first < pairs.size(); first += kLanes) {
    const std::size_t lanes = std::min<std::size_t>(kLanes, pairs.size() - first);
    const FeaturePair* of[kLanes];
    std::array<double, kLanes> separation;
    for (std::size_t i = 0; i < kLanes; ++i) {
      const std::size_t pair = first + (i < lanes ? i : 0);
      of[i] = &pairs[pair];
      separation[i] = separation_of(pair);
    }
    unsigned near = 0, apart = 0;
    decide(of, place_of, load<Lanes>(separation.data()), excess, near, apart);
    for (std::size_t i = 0; i < lanes; ++i)
      nearness[first + i] = (near >> i & 1U) != 0    ? Nearness::kNear
                            : (apart >> i & 1U) != 0 ? Nearness::kApart
                                                     : Nearness::kUnproved;
  }
}

}  // namespace

WARMFRONT_TARGET_CLONES
void proximity_filter(std::span<const FeaturePair> pairs, std::span<const VertexMotion> vertices, Instant at,
                      std::span<const double> separations, Nearness* nearness, double excess) {
  const auto instant = at == Instant::kStart ? &VertexMotion::t0 : &VertexMotion::t1;
  filter(
      pairs, [&](std::uint32_t v) -> const Place& { return vertices[v].*instant; },
      [&](std::size_t pair) { return separations[pair]; }, excess, nearness);
}

WARMFRONT_TARGET_CLONES
void proximity_filter(std::span<const FeaturePair> pairs, std::span<const std::array<double, 4>> places,
                      double separation, Nearness* nearness) {
  filter(
      pairs, [&](std::uint32_t v) -> const Place& { return places[v]; },
      [&](std::size_t) { return separation; }, 0, nearness);
}

}  // namespace warmfront

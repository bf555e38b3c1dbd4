// SPDX-License-Identifier: Apache-2.0
// The stage between the coplanarity filter and the elementary tests: directions that separate a pair for the
// whole step, several pairs at a time. Pure functions.
#include "engine/narrow_phase/separation_filter.h"

#include <algorithm>
#include <array>
#include <cstring>

#include "engine/elementary/vec3.h"
#include "engine/simd/lanes3.h"
#include "engine/simd/target_clones.h"

namespace warmfront {
namespace {

constexpr int kLanes = 4;

using Lanes = Double4;
using LaneMask = decltype(Lanes{} < Lanes{});

using Four3 = Lanes3<Lanes>;

// The polygon of differences between the primitives (exact_polygon.h) at both times: a triangle, which
// repeats its first corner at the end, or a parallelogram.
using Polygons = Four3[2][4];  // [time][corner]

// One corner of four pairs, at one end of the step.
WARMFRONT_INLINE void gather(const VertexMotion* const (&vertex)[kLanes][2],
                             std::array<double, 4> VertexMotion::*end, Four3& to) {
  Lanes of[kLanes];  // a pair's difference: x, y, z and padding
  for (int i = 0; i < kLanes; ++i) {
    Lanes minuend;
    Lanes subtrahend;
    std::memcpy(&minuend, (vertex[i][0]->*end).data(), sizeof minuend);
    std::memcpy(&subtrahend, (vertex[i][1]->*end).data(), sizeof subtrahend);
    of[i] = minuend - subtrahend;
  }
  const Lanes xz01 = __builtin_shuffle(of[0], of[1], LaneMask{0, 4, 2, 6});
  const Lanes xz23 = __builtin_shuffle(of[2], of[3], LaneMask{0, 4, 2, 6});
  const Lanes y01 = __builtin_shuffle(of[0], of[1], LaneMask{1, 5, 3, 7});
  const Lanes y23 = __builtin_shuffle(of[2], of[3], LaneMask{1, 5, 3, 7});
  to.x = __builtin_shuffle(xz01, xz23, LaneMask{0, 1, 4, 5});
  to.y = __builtin_shuffle(y01, y23, LaneMask{0, 1, 4, 5});
  to.z = __builtin_shuffle(xz01, xz23, LaneMask{2, 3, 6, 7});
}

WARMFRONT_INLINE void gather(const FeaturePair* const (&pairs)[kLanes],
                             std::span<const VertexMotion> vertices, Polygons& to) {
  // The vertices whose difference is a corner: one of the second primitive minus one of the first.
  constexpr int kCorners[2][4][2]{{{1, 0}, {2, 0}, {3, 0}, {1, 0}}, {{2, 0}, {3, 0}, {3, 1}, {2, 1}}};
  for (int k = 0; k < 4; ++k) {
    const VertexMotion* vertex[kLanes][2];
    for (int i = 0; i < kLanes; ++i) {
      const auto& corner = kCorners[pairs[i]->kind == ContactKind::kEdgeEdge][k];
      for (int end = 0; end < 2; ++end) vertex[i][end] = &vertices[pairs[i]->vertices[corner[end]]];
    }
    gather(vertex, &VertexMotion::t0, to[0][k]);
    gather(vertex, &VertexMotion::t1, to[1][k]);
  }
}

// Where `direction` keeps all corners on one side of the origin at both times.
//
// A corner moves linearly, and so does its product with a direction: beyond 0 at both ends, beyond 0
// throughout. Error bound, with |d| and |p| the largest coordinates: a corner has one rounding, a product of
// three terms at most three more a term, so it is within 3 * 4.01 u |d| |p|; 16 u |d| |p| is used, which
// covers the rounding of the bound. Products that underflow err by 2^-1074 each: 2^-1000 covers them.
WARMFRONT_INLINE LaneMask keeps_apart(const Polygons& p, const Four3& direction, const Lanes& size) {
  Lanes lowest = dot(direction, p[0][0]);
  Lanes highest = lowest;
  for (int k = 1; k < 8; ++k) {
    const Lanes along = dot(direction, p[k / 4][k % 4]);
    lowest = lesser(lowest, along);
    highest = greater(highest, along);
  }
  const Lanes slack = 16 * kUnit * largest_of(magnitudes(direction)) * size + 0x1p-1000;
  return (lowest > slack) | (highest < -slack);
}

// Bit i is set where a direction separates pair i.
//
// When primitives pass each other at speed, they are stationary as seen along their mean relative motion v,
// up to rotation and deformation: a line that separates them there separates them for the whole step. The
// projected polygon of differences is convex, and if the origin is outside, one of its sides proves it: the
// normal of side S is S x v. (For two convex polygons that only translate this test is complete.)
WARMFRONT_INLINE unsigned certainly_apart(const Polygons& p) {
  Lanes size{};
  for (int time = 0; time < 2; ++time) {
    for (int k = 0; k < 4; ++k) {
      size = greater(size, largest_of(magnitudes(p[time][k])));
    }
  }
  const Four3 v = ((p[1][0] - p[0][0]) + (p[1][1] - p[0][1])) + ((p[1][2] - p[0][2]) + (p[1][3] - p[0][3]));
  LaneMask apart{};
  for (int k = 0; k < 3; ++k) {  // opposite sides of a parallelogram are parallel
    const Four3 begin = p[0][k] + p[1][k];
    const Four3 end = p[0][k + 1] + p[1][k + 1];
    apart |= keeps_apart(p, cross(end - begin, v), size);
  }
  apart &= size < 0x1p300;  // no overflow, no NaN
  unsigned mask = 0;
  for (int i = 0; i < kLanes; ++i) mask |= static_cast<unsigned>(apart[i] & 1) << i;
  return mask;
}

}  // namespace

WARMFRONT_TARGET_CLONES
std::size_t separation_filter(std::span<const FeaturePair> pairs, std::span<const VertexMotion> vertices,
                              std::uint16_t* survivors, std::size_t count) {
  std::size_t kept = 0;
  for (std::size_t first = 0; first < count; first += kLanes) {
    const std::size_t lanes = std::min<std::size_t>(kLanes, count - first);
    const FeaturePair* of[kLanes];
    for (std::size_t i = 0; i < kLanes; ++i) of[i] = &pairs[survivors[first + (i < lanes ? i : 0)]];
    Polygons polygons;
    gather(of, vertices, polygons);
    const unsigned apart = certainly_apart(polygons);
    for (std::size_t i = 0; i < lanes; ++i) {
      survivors[kept] = survivors[first + i];
      kept += ((apart >> i) & 1U) == 0;
    }
  }
  return kept;
}

}  // namespace warmfront

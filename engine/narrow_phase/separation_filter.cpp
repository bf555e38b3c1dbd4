// SPDX-License-Identifier: Apache-2.0
// The stage between the coplanarity filter and the elementary tests: directions that separate a pair for the
// whole step, several pairs at a time. Pure functions.
#include "engine/narrow_phase/separation_filter.h"

#include <algorithm>

#include "engine/elementary/vec3.h"
#include "engine/narrow_phase/difference_polygons.h"
#include "engine/simd/lanes3.h"
#include "engine/simd/target_clones.h"

namespace warmfront {
namespace {

using namespace difference_polygons;  // NOLINT: what this filter works on

using Polygons = Corners[2];  // [time]

// Where `direction` keeps all corners on one side of the origin at both times.
//
// A corner moves linearly, and so does its product with a direction: beyond 0 at both ends, beyond 0
// throughout. Error bound, with |d| and |p| the largest coordinates: a corner has one rounding, a product of
// three terms at most three more a term, so it is within 3 * 4.01 u |d| |p|; 16 u |d| |p| is used, which
// covers the rounding of the bound. Products that underflow err by 2^-1074 each: 2^-1000 covers them.
WARMFRONT_INLINE Mask keeps_apart(const Polygons& p, const Four3& direction, const Lanes& size) {
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
  const Lanes size = greater(size_of(p[0]), size_of(p[1]));
  const Four3 v = ((p[1][0] - p[0][0]) + (p[1][1] - p[0][1])) + ((p[1][2] - p[0][2]) + (p[1][3] - p[0][3]));
  Mask apart{};
  for (int k = 0; k < 3; ++k) {  // opposite sides of a parallelogram are parallel
    const Four3 begin = p[0][k] + p[1][k];
    const Four3 end = p[0][k + 1] + p[1][k + 1];
    apart |= keeps_apart(p, cross(end - begin, v), size);
  }
  apart &= size < 0x1p300;  // no overflow, no NaN
  return bits_of(apart);
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
    gather(of, vertices, &VertexMotion::t0, polygons[0]);
    gather(of, vertices, &VertexMotion::t1, polygons[1]);
    const unsigned apart = certainly_apart(polygons);
    for (std::size_t i = 0; i < lanes; ++i) {
      survivors[kept] = survivors[first + i];
      kept += ((apart >> i) & 1U) == 0;
    }
  }
  return kept;
}

}  // namespace warmfront

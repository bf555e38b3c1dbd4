// SPDX-License-Identifier: Apache-2.0
// Bounds in lanes: the inlined core of all overlap tests. Only for sources that dispatch by instruction set.
#pragma once

#include <array>

#include "engine/bounds/kdop.h"
#include "engine/bounds/point_bounds.h"
#include "engine/bounds/width.h"
#include "engine/simd/lanes.h"

namespace warmfront {

// Eight axes of an 18-DOP at one end of the step.
struct EightAxes {
  Float8 lower;
  Float8 upper;
};

WARMFRONT_INLINE EightAxes eight_axes(const KDop18& k, int begin) {
  return {load<Float8>(&k.lane[begin]), load<Float8>(&k.lane[begin + 9])};
}

// The axes of a vertex, as slab_ends().
WARMFRONT_INLINE EightAxes eight_axes(const PointBounds& point, std::size_t t) {
  constexpr Float8 kSign{0, 0, 0, 1, -1, 1, -1, 1};
  constexpr float kDiagonal = PointBounds::kDiagonal;
  constexpr Float8 kBeyond{1, 1, 1, kDiagonal, kDiagonal, kDiagonal, kDiagonal, kDiagonal};
  const auto p = load<Float4>(point.at[t].data());
  const Float8 at = spread<0, 1, 2, 0, 0, 1, 1, 2>(p) + kSign * spread<1, 1, 1, 1, 1, 2, 2, 0>(p);
  const Float8 beyond = kBeyond * spread<3, 3, 3, 3, 3, 3, 3, 3>(p);
  return {at - beyond, -at - beyond};
}

WARMFRONT_INLINE EightAxes merged(const EightAxes& a, const EightAxes& b) {
  return {lesser(a.lower, b.lower), lesser(a.upper, b.upper)};
}

// From a gap at t = 0 and at t = 1: positive if it stays open throughout the step.
struct Throughout {
  WARMFRONT_INLINE Float8 operator()(Float8 at0, Float8 at1) const { return lesser(at0, at1); }
};

// The same up to a time below 1. A gap between bounds is at least the interpolated one, because the vertices'
// gaps are linear; four roundings of values up to |at0| + |at1| are far below 2^-20 of that, and so are those
// of sums from which a width was subtracted, which are up to that much larger.
struct Until {
  float time;
  float width = 0;
  WARMFRONT_INLINE Float8 operator()(Float8 at0, Float8 at1) const {
    const Float8 then = at0 + time * (at1 - at0) - 0x1p-20F * (magnitude(at0) + magnitude(at1) + 2 * width);
    return lesser(at0, then);
  }
};

// A width along eight axes of an 18-DOP.
WARMFRONT_INLINE Float8 eight_axes(const Width& width) {
  const float s = width.straight;
  const float d = width.diagonal;
  return Float8{s, s, s, d, d, d, d, d};
}

// Positive in the lanes of axes that separate a and b by more than `width`, on one side.
template <class When>
WARMFRONT_INLINE Float8 gap(When open, const EightAxes& a0, const EightAxes& a1, const EightAxes& b0,
                            const EightAxes& b1, const Float8& width) {
  return greater(open(a0.lower + b0.upper - width, a1.lower + b1.upper - width),
                 open(a0.upper + b0.lower - width, a1.upper + b1.lower - width));
}

// Rounding is monotone, so of sums less a width the least and the greatest are those of the sums, less it
// once.
WARMFRONT_INLINE Float8 gap(Throughout open, const EightAxes& a0, const EightAxes& a1, const EightAxes& b0,
                            const EightAxes& b1, const Float8& width) {
  return greater(open(a0.lower + b0.upper, a1.lower + b1.upper),
                 open(a0.upper + b0.lower, a1.upper + b1.lower)) -
         width;
}

// The same for one axis.
template <class Bounds>
WARMFRONT_INLINE bool apart_along(const Bounds& a, const Bounds& b, const Width& width, int axis) {
  constexpr int kAxes = Bounds::kAxes;
  constexpr int kEnd = Bounds::kEnd;
  const float beyond = width.along(axis);
  const auto sums = [&](int end) {
    return std::array{a.lane[end + axis] + b.lane[end + axis + kAxes],
                      a.lane[end + axis + kAxes] + b.lane[end + axis]};
  };
  const auto at0 = sums(0);
  const auto at1 = sums(kEnd);
  return ((at0[0] > beyond) & (at1[0] > beyond)) | ((at0[1] > beyond) & (at1[1] > beyond));
}

WARMFRONT_INLINE bool meet(const Aabb& a, const Aabb& b, const Width& width) {
  return !(apart_along(a, b, width, 0) | apart_along(a, b, width, 1) | apart_along(a, b, width, 2));
}

WARMFRONT_INLINE bool meet(const KDop18& a, const KDop18& b, const Width& width) {
  const auto apart = (Int8)(gap(Throughout{}, eight_axes(a, 0), eight_axes(a, 18), eight_axes(b, 0),
                                eight_axes(b, 18), eight_axes(width)) > 0.0F);
  return !any(apart) && !apart_along(a, b, width, 8);
}

// The wider of an axis' two gaps at the end whose lanes begin at kFrom.
template <std::size_t kFrom, class Bounds>
WARMFRONT_INLINE float gap_along(const Bounds& a, const Bounds& b, int axis) {
  constexpr std::size_t kUpper = kFrom + Bounds::kAxes;
  return greater(a.lane[kFrom + axis] + b.lane[kUpper + axis], a.lane[kUpper + axis] + b.lane[kFrom + axis]);
}

// As separation() of overlap.h, at the end whose lanes begin at kFrom: 0 or kEnd.
template <std::size_t kFrom>
WARMFRONT_INLINE float gap_at(const Aabb& a, const Aabb& b, const Width& width) {
  if (meet(a, b, width)) return -1;
  return greater(greater(gap_along<kFrom>(a, b, 0), gap_along<kFrom>(a, b, 1)), gap_along<kFrom>(a, b, 2));
}

template <std::size_t kFrom>
WARMFRONT_INLINE float gap_at(const KDop18& a, const KDop18& b, const Width& width) {
  if (meet(a, b, width)) return -1;
  constexpr Float8 kWeight{1, 1, 1, 0.5F, 0.5F, 0.5F, 0.5F, 0.5F};
  const EightAxes at_a = eight_axes(a, kFrom);
  const EightAxes at_b = eight_axes(b, kFrom);
  const Float8 gaps = kWeight * greater(at_a.lower + at_b.upper, at_a.upper + at_b.lower);
  return greater(largest(gaps), 0.5F * gap_along<kFrom>(a, b, 8));
}

}  // namespace warmfront

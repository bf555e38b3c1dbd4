// SPDX-License-Identifier: Apache-2.0
// Which of eight gaps stay open in a part of the step, from their numbers at both ends (leaf_grid.h). Only
// for sources that dispatch by instruction set.
#pragma once

#include <array>
#include <cstdint>
#include <limits>

#include "engine/bounds/bounds_lanes.h"
#include "engine/bvh/leaf_grid.h"

namespace warmfront {

WARMFRONT_INLINE Short16 swapped(Short16 v) {
  return shuffle<1, 0, 3, 2, 5, 4, 7, 6, 9, 8, 11, 10, 13, 12, 15, 14>(v, v);
}

// The larger of each slot's two numbers, twice.
WARMFRONT_INLINE Short16 larger_of(Short16 v) {
  return greater(v, swapped(v));
}

// The widest gap, per slot, that stays open: positive if there is one. From gaps at t = 0 and t = 1, each in
// its own unit.
struct OpenThroughout {
  Short16 widest = Short16{} + std::numeric_limits<std::int16_t>::min();

  WARMFRONT_INLINE void see(Short16 at0, Short16 at1) { widest = greater(lesser(at0, at1), widest); }
  WARMFRONT_INLINE Short16 result() const { return larger_of(widest); }
};

// The same up to a time below 1. In float32, since the units differ.
struct OpenUntil {
  Until until;
  std::array<float, 2> unit;
  Float8 widest = Float8{} - 1;

  WARMFRONT_INLINE Float8 open(Int8 at0, Int8 at1) const {
    return until(unit[0] * to_floats(at0), unit[1] * to_floats(at1));
  }
  WARMFRONT_INLINE void see(Short16 at0, Short16 at1) {
    const Float8 low = open(((Int8)at0 << 16) >> 16, ((Int8)at1 << 16) >> 16);
    const Float8 high = open((Int8)at0 >> 16, (Int8)at1 >> 16);
    widest = greater(greater(low, high), widest);
  }
  WARMFRONT_INLINE Short16 result() const { return surely((Short16)(widest > 0.0F) != 0); }

  // Overlaps up to a time within this step are not reused in later steps: none is unsure.
  template <class Mask>
  WARMFRONT_INLINE static Short16 surely(Mask open) {
    constexpr std::int16_t kOpen = 1;
    constexpr std::int16_t kShut = -GridPair<Aabb>::kSlack;
    return select(open, Short16{} + kOpen, Short16{} + kShut);
  }
};

// The same up to a time by which what is `least` units apart at t = 0 cannot have come together.
struct OpenSoon {
  std::int16_t least;
  Short16 widest = Short16{} + std::numeric_limits<std::int16_t>::min();

  /// So few units are little beside a leaf, which is some thousands wide.
  static constexpr std::int16_t kFew = 32;

  // 0 where no leaf is so wide. With a number n0 at t = 0 and n1 at t = 1, of units u0 and u1, the gap at
  // `until` is at least (1 - until) n0 u0 + until n1 u1. Each rounding here is within 2^-24, and 1 - until is
  // at least 2^-24 where it is not 0.
  template <class Bounds>
  WARMFRONT_INLINE static std::int16_t least_for(float until, const GridPair<Bounds>& between) {
    constexpr float kMost = LeafGrid<Bounds>::kReach;
    const float closing =
        until * -between.least_at_1 * (between.unit[1] / between.unit[0]) / (1 - until) * (1 + 0x1p-10F);
    return closing < kMost ? static_cast<std::int16_t>(static_cast<int>(closing) + 1) : std::int16_t{0};
  }

  WARMFRONT_INLINE void see(Short16 at0, Short16) { widest = greater(at0, widest); }
  WARMFRONT_INLINE Short16 result() const {
    return OpenUntil::surely(larger_of(widest) >= Short16{} + least);
  }
};

}  // namespace warmfront

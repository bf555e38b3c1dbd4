// SPDX-License-Identifier: Apache-2.0
// Integer bounds, 16 bits each, for the contents of a leaf: half the bytes of float32, and twice as many in a
// register. Plain values. Bounds relative to their parent's, in few bits: Mahovsky, Wyvill 2006; here at both
// ends of the step, and comparable between leaves.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>

#include "engine/bounds/kdop.h"
#include "engine/bounds/width.h"
#include "engine/simd/target_clones.h"

namespace warmfront {

/// An integer below x and below the value that x was rounded from, for |x| up to 8500: x is a scaled
/// difference of float32, so its relative error is 2^-24, and the sum here rounds by at most 2^-10; together
/// less than the distance of kGridUp from its integer. Truncation rounds positive values down.
inline constexpr std::int32_t kGridBase = 8704;
inline constexpr float kGridUp = kGridBase - 0x1p-9F;
WARMFRONT_INLINE std::int32_t grid_floor(float x) {
  return static_cast<std::int32_t>(x + kGridUp) - kGridBase;
}

/// Quantisation of a leaf's primitives: along each axis and at each end of the step, a lower end counts units
/// of 2^exponent from the middle of the leaf, and so does a negated upper end; both rounded down, so that the
/// bounds stay conservative. It depends only on the leaf's bounds, each end on its own.
///
/// Numbers of one leaf are within kReach units either way (plus one for rounding). If a leaf is too wide, or
/// its bounds are not finite, all are kNever, from which nothing is apart.
template <class Bounds>
struct LeafGrid {
  static constexpr std::size_t kAxes = Bounds::kAxes;
  static constexpr int kReach = 4080;
  static constexpr std::int16_t kNever = -12272;
  static constexpr int kNoUnit = 126;  ///< the exponent of a leaf with kNever: the greatest
  static constexpr int kLeastUnit = -100;

  /// The grid at one end of the step.
  struct End {
    std::array<float, kAxes> origin{};
    std::int32_t exponent = kNoUnit;

    WARMFRONT_INLINE bool none() const { return exponent == kNoUnit; }
    bool operator==(const End&) const = default;
  };

  /// 2^exponent; -126 to 127.
  WARMFRONT_INLINE static float power(int exponent) {
    return std::bit_cast<float>(static_cast<std::uint32_t>(127 + exponent) << 23);
  }

  /// Sets the grid for one end of the step (0 or 1) from the leaf's bounds.
  WARMFRONT_INLINE void set(const Bounds& leaf, std::size_t t) {
    float reach = 0;
    bool bounded = true;
    const float* lower = leaf.lane.data() + t * Bounds::kEnd;
    const float* upper = lower + kAxes;  // negated
    End& grid = end[t];
    for (std::size_t k = 0; k < kAxes; ++k) {
      const float middle = 0.5F * lower[k] - 0.5F * upper[k];
      grid.origin[k] = middle;
      const float wider = std::max(middle - lower[k], -upper[k] - middle);
      bounded &= wider < 0x1p125F;  // false for NaN
      reach = std::max(reach, wider);
    }
    if (!bounded) {
      grid = {};
      for (std::size_t k = 0; k < kAxes; ++k) whole[t * kAxes + k] = {kNever, kNever};
      return;
    }
    // reach < 2^(e + 1), and in units of 2^(e - 11) less than 4096.
    const int e = static_cast<int>(std::bit_cast<std::uint32_t>(reach) >> 23) - 127;
    grid.exponent = std::max(kLeastUnit, e - 11);
    if (!(reach * power(-grid.exponent) < kReach)) ++grid.exponent;
    const float scale = power(-grid.exponent);
    for (std::size_t k = 0; k < kAxes; ++k) {
      whole[t * kAxes + k] = {static_cast<std::int16_t>(grid_floor((lower[k] - grid.origin[k]) * scale)),
                              static_cast<std::int16_t>(grid_floor((upper[k] + grid.origin[k]) * scale))};
    }
  }

  /// Starts the next step: t = 1 becomes t = 0.
  WARMFRONT_INLINE void shift() {
    begin_at_1 = kAxes - begin_at_1;
    end[0] = end[1];
    std::copy_n(whole.begin() + kAxes, kAxes, whole.begin());
  }

  std::array<End, 2> end;
  /// Where t = 1 begins among the rows of its blocks: 0 or kAxes. Toggles with each step, so that the numbers
  /// of t = 1 need not be moved.
  std::uint32_t begin_at_1 = kAxes;
  /// The leaf's own bounds, lower and upper ends, by end of the step and axis.
  alignas(4) std::array<std::array<std::int16_t, 2>, std::size_t{2} * kAxes> whole;

  /// Compares the numbers, wherever those of t = 1 are stored.
  bool operator==(const LeafGrid& other) const { return end == other.end && whole == other.whole; }
};

/// The relation between the numbers of leaf a and of leaf b. By end and axis, a pair of 16-bit numbers, the
/// low half first: the offsets to add to (a's upper end + b's lower end) and to (a's lower end + b's upper
/// end), so that the sum is a lower bound of the gap with b above a, and with a above b, in common units, less
/// the question's width.
template <class Bounds>
struct GridPair {
  std::array<std::int32_t, std::size_t{2} * Bounds::kAxes> offset;
  /// The numbers are first shifted right by this, by end; 0 for one of the leaves, unless the width is large.
  std::array<std::int32_t, 2> shift_a;
  std::array<std::int32_t, 2> shift_b;
  std::array<float, 2> unit;  ///< lengths of the common units
  /// What a sum, halved for a diagonal, lacks at least of the gap itself: from below.
  float lacks = 0;
  /// No sum at t = 1 would be less, in common units, if offsets were not clamped: -infinity where that is not
  /// known. Told by learn_end(), for who asks about a part of the step.
  float least_at_1 = -std::numeric_limits<float>::infinity();
  /// LeafGrid::begin_at_1 of a and of b: available before their blocks have arrived from memory.
  std::uint32_t begin_at_1_of_a;
  std::uint32_t begin_at_1_of_b;

  /// Largest gap; and its negative, below which two leaves' numbers cannot be apart.
  static constexpr float kMost = 8176;
  static constexpr float kLeast = -8176;
  /// The same where a width was subtracted: so a gap that a leaf's numbers cannot close is still negative
  /// without the width.
  static constexpr float kLeastOfWidth = kLeast - 4112;
  /// No number of a leaf, but kNever, is larger in magnitude.
  static constexpr float kMostNumber = LeafGrid<Bounds>::kReach + 1;
  /// No width is more than 2^this units.
  static constexpr int kWidthBits = 12;
  /// A gap is at most this many units below the float32 bounds' gap: six roundings.
  static constexpr int kSlack = 6;

  /// Of the leaves and the width that this is of: how far offsets at t = 1 go, and one unit for what a whole
  /// number below is less.
  WARMFRONT_INLINE void learn_end(const LeafGrid<Bounds>& a, const LeafGrid<Bounds>& b, const Width& width) {
    const auto& at = a.end[1];
    const auto& bt = b.end[1];
    if (at.none() || bt.none()) return;
    double farthest = 0;
    for (std::size_t k = 0; k < LeafGrid<Bounds>::kAxes; ++k)
      farthest = std::max(farthest, std::fabs(double{bt.origin[k]} - double{at.origin[k]}));
    const double units = (farthest + double{width.diagonal}) / double{unit[1]};
    least_at_1 = -static_cast<float>(units * (1 + 0x1p-20) + 1) - 2 * kMostNumber;
  }
  /// Are sums at t = 1 lower bounds? Where an offset was clamped they tell the sign of a gap alone.
  WARMFRONT_INLINE bool tells_gaps_at_1() const { return least_at_1 > kLeast - 2 * kMostNumber; }

  WARMFRONT_INLINE static GridPair of(const LeafGrid<Bounds>& a, const LeafGrid<Bounds>& b,
                                      const Width& width) {
    if (width.none()) return made<false>(a, b, width);
    return made<true>(a, b, width);
  }

  template <bool kWide>
  WARMFRONT_INLINE static GridPair made(const LeafGrid<Bounds>& a, const LeafGrid<Bounds>& b,
                                        const Width& width) {
    using Grid = LeafGrid<Bounds>;
    GridPair pair;
    pair.begin_at_1_of_a = a.begin_at_1;
    pair.begin_at_1_of_b = b.begin_at_1;
    if (kWide) pair.lacks = 0.5F * width.diagonal * (1 - 0x1p-22F);
    for (std::size_t t = 0; t < 2; ++t) {
      const auto& at = a.end[t];
      const auto& bt = b.end[t];
      int common = std::max(at.exponent, bt.exponent);
      if (kWide) common = std::max(common, std::ilogb(width.diagonal) + 1 - kWidthBits);
      pair.shift_a[t] = std::min(common - at.exponent, 15);
      pair.shift_b[t] = std::min(common - bt.exponent, 15);
      pair.unit[t] = Grid::power(common);
      const float scale = Grid::power(-common);
      for (std::size_t k = 0; k < Grid::kAxes; ++k) {
        std::int32_t above;
        std::int32_t below;
        if constexpr (kWide) {
          // In double, since two large numbers may nearly cancel.
          const double d = (double{bt.origin[k]} - double{at.origin[k]}) * double{scale};
          const double beyond = double{k < 3 ? width.straight : width.diagonal} * double{scale};
          above = whole_below(d - beyond);
          below = whole_below(-d - beyond);
        } else {
          const float d = (bt.origin[k] - at.origin[k]) * scale;
          above = whole_below(d);
          below = whole_below(-d);
        }
        pair.offset[t * Grid::kAxes + k] = (below << 16) | (above & 0xffff);
      }
    }
    return pair;
  }

  // No sum of two numbers and an offset overflows 16 bits, and none becomes positive wrongly.
  static_assert(kMost + 2 * LeafGrid<Bounds>::kReach < 0x1p15F);
  // Leaves so far apart that the offset is clamped are still apart.
  static_assert(kMost - 1 - 2 * (LeafGrid<Bounds>::kReach + 1) > 0);
  static_assert(LeafGrid<Bounds>::kNever + kMost + LeafGrid<Bounds>::kReach < 0);
  static_assert(kLeast + 2 * LeafGrid<Bounds>::kReach < 0);
  static_assert(2 * LeafGrid<Bounds>::kNever + kLeast > -0x1p15F);
  // Those of kNever have the largest unit there is: their offsets are a few units.
  static_assert(kLeastOfWidth - 2 * (LeafGrid<Bounds>::kReach + 1) > -0x1p15F);
  static_assert(kLeastOfWidth + 2 * (LeafGrid<Bounds>::kReach + 1) + (1 << kWidthBits) < 0);

 private:
  // The same of a difference less a width: neither is far beyond the clamp, so that x is off by 2^-38 at most.
  WARMFRONT_INLINE static std::int32_t whole_below(double x) {
    constexpr std::int32_t kBase = 16384;
    const double clamped = x < kLeastOfWidth ? double{kLeastOfWidth} : (x < kMost ? x : double{kMost});
    return static_cast<std::int32_t>(clamped + (kBase - 0x1p-30)) - kBase;
  }
  // An integer below x, clamped.
  WARMFRONT_INLINE static std::int32_t whole_below(float x) {
    return grid_floor(x < kLeast ? kLeast : (x < kMost ? x : kMost));
  }
};

}  // namespace warmfront

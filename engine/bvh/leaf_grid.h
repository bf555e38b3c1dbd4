// SPDX-License-Identifier: Apache-2.0
// Small whole numbers for the bounds of what is below a leaf: half the bytes of float32, and twice as many in
// a register. Plain values. The idea of bounds relative to their parent's, in few bits: Mahovsky, Wyvill
// 2006; here at both ends of the step, and comparable between leaves.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>

#include "engine/bounds/kdop.h"
#include "engine/simd/target_clones.h"

namespace warmfront {

/// A whole number below x and below what x was rounded from, for |x| up to 8500: x is a difference of
/// float32, scaled, so it carries 2^-24 of itself, and the sum here rounds by 2^-10 at most; together that is
/// less than what kGridUp is short of its whole number. Truncation rounds down what is positive.
inline constexpr std::int32_t kGridBase = 8704;
inline constexpr float kGridUp = kGridBase - 0x1p-9F;
WARMFRONT_INLINE std::int32_t grid_floor(float x) {
  return static_cast<std::int32_t>(x + kGridUp) - kGridBase;
}

/// A leaf's bounds as its primitives' are held: along each axis, and at each end of the step, a lower end
/// counts units of 2^exponent from the middle of the leaf, and an upper end, negated, the same from there;
/// both from below, so that what they bound is inside. It follows from the leaf's bounds alone, each end from
/// its own.
///
/// Numbers of one leaf keep to kReach units either way (and one for rounding). Of a leaf that is too wide, or
/// whose bounds are not finite, all are kNever, from which nothing is apart.
template <class Bounds>
struct LeafGrid {
  static constexpr std::size_t kAxes = Bounds::kAxes;
  static constexpr int kReach = 4080;
  static constexpr std::int16_t kNever = -12272;
  static constexpr int kNoUnit = 126;  ///< the exponent of a leaf whose numbers are kNever: none is greater
  static constexpr int kLeastUnit = -100;

  /// Of one end.
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

  /// Makes the grid of an end of the step (0 or 1) for a leaf of these bounds.
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
      bounded &= wider < 0x1p125F;  // false, too, for what is not a number
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

  /// A step later: what was at t = 1 is at t = 0.
  WARMFRONT_INLINE void shift() {
    begin_at_1 = kAxes - begin_at_1;
    end[0] = end[1];
    std::copy_n(whole.begin() + kAxes, kAxes, whole.begin());
  }

  std::array<End, 2> end;
  /// Where t = 1 begins among the rows of its blocks: 0 or kAxes. Both ends change places with each step:
  /// what was at t = 1 stays where it is.
  std::uint32_t begin_at_1 = kAxes;
  /// The leaf's own bounds, lower and upper ends, by end of the step and axis.
  alignas(4) std::array<std::array<std::int16_t, 2>, std::size_t{2} * kAxes> whole;

  /// The same numbers, wherever those of t = 1 are.
  bool operator==(const LeafGrid& other) const { return end == other.end && whole == other.whole; }
};

/// How the numbers of leaf a stand to those of leaf b. By end and axis, a pair of 16 bits, the low half
/// first: what to add to (a's upper end + b's lower end) and to (a's lower end + b's upper end), so that the
/// sum is the gap between b above a, and a above b, in common units, from below.
template <class Bounds>
struct GridPair {
  std::array<std::int32_t, std::size_t{2} * Bounds::kAxes> offset;
  /// The numbers are first shifted right so far, by end; of one leaf by 0.
  std::array<std::int32_t, 2> shift_a;
  std::array<std::int32_t, 2> shift_b;
  std::array<float, 2> unit;  ///< lengths of the common units
  /// As LeafGrid says of a and of b: known before their blocks have come from memory.
  std::uint32_t begin_at_1_of_a;
  std::uint32_t begin_at_1_of_b;

  /// Gaps reach so far up; and so far down, where two leaves' numbers cannot be apart any more.
  static constexpr float kMost = 8176;
  static constexpr float kLeast = -8176;
  /// A gap is at most so many units below what the bounds in float32 say: five roundings.
  static constexpr int kSlack = 5;

  WARMFRONT_INLINE static GridPair of(const LeafGrid<Bounds>& a, const LeafGrid<Bounds>& b) {
    using Grid = LeafGrid<Bounds>;
    GridPair pair;
    pair.begin_at_1_of_a = a.begin_at_1;
    pair.begin_at_1_of_b = b.begin_at_1;
    for (std::size_t t = 0; t < 2; ++t) {
      const auto& at = a.end[t];
      const auto& bt = b.end[t];
      const int common = std::max(at.exponent, bt.exponent);
      pair.shift_a[t] = std::min(common - at.exponent, 15);
      pair.shift_b[t] = std::min(common - bt.exponent, 15);
      pair.unit[t] = Grid::power(common);
      const float scale = Grid::power(-common);
      for (std::size_t k = 0; k < Grid::kAxes; ++k) {
        const float d = (bt.origin[k] - at.origin[k]) * scale;
        const std::int32_t above = whole_below(d);
        const std::int32_t below = whole_below(-d);
        pair.offset[t * Grid::kAxes + k] = (below << 16) | (above & 0xffff);
      }
    }
    return pair;
  }

  // No sum of two numbers and an offset leaves 16 bits, and none that ought not to is positive.
  static_assert(kMost + 2 * LeafGrid<Bounds>::kReach < 0x1p15F);
  // What is so far away that the offset is limited is apart all the same.
  static_assert(kMost - 1 - 2 * (LeafGrid<Bounds>::kReach + 1) > 0);
  static_assert(LeafGrid<Bounds>::kNever + kMost + LeafGrid<Bounds>::kReach < 0);
  static_assert(kLeast + 2 * LeafGrid<Bounds>::kReach < 0);
  static_assert(2 * LeafGrid<Bounds>::kNever + kLeast > -0x1p15F);

 private:
  // A whole number below x, within the limits.
  WARMFRONT_INLINE static std::int32_t whole_below(float x) {
    return grid_floor(x < kLeast ? kLeast : (x < kMost ? x : kMost));
  }
};

}  // namespace warmfront

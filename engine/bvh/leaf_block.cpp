// SPDX-License-Identifier: Apache-2.0
#include "engine/bvh/leaf_block.h"

#include <bit>
#include <cstring>
#include <limits>

#include "engine/bounds/lanes.h"

namespace warmfront {
namespace {

using Byte8 = std::uint8_t __attribute__((vector_size(8)));

constexpr Int8 kLaneBit{1, 2, 4, 8, 16, 32, 64, 128};
constexpr Int8 kSlot{0, 1, 2, 3, 4, 5, 6, 7};
constexpr std::int16_t kFarthest = std::numeric_limits<std::int16_t>::max();
constexpr Short16 kFar = Short16{} + kFarthest;

// A pair of 16 bits in all eight slots.
WARMFRONT_INLINE Short16 in_all(std::int32_t pair) {
  return (Short16)(Int8{} + pair);
}
WARMFRONT_INLINE Short16 in_all(const std::int16_t* pair) {
  std::int32_t both;
  std::memcpy(&both, pair, sizeof both);
  return in_all(both);
}

WARMFRONT_INLINE Short16 swapped(Short16 v) {
  return __builtin_shufflevector(v, v, 1, 0, 3, 2, 5, 4, 7, 6, 9, 8, 11, 10, 13, 12, 15, 14);
}

// The larger of each slot's two numbers, twice.
WARMFRONT_INLINE Short16 larger_of(Short16 v) {
  return greater(v, swapped(v));
}

// How far open the widest gap is that stays open, in each slot: positive where one does. From gaps at t = 0
// and t = 1, each in units of its own.
struct OpenThroughout {
  Short16 widest = Short16{} + std::numeric_limits<std::int16_t>::min();

  WARMFRONT_INLINE void see(Short16 at0, Short16 at1) { widest = greater(lesser(at0, at1), widest); }
  WARMFRONT_INLINE Short16 result() const { return larger_of(widest); }
};

// The same up to a time below 1. As the units differ, in float32.
struct OpenUntil {
  Until until;
  std::array<float, 2> unit;
  Float8 widest = Float8{} - 1;

  WARMFRONT_INLINE Float8 open(Int8 at0, Int8 at1) const {
    return until(unit[0] * __builtin_convertvector(at0, Float8),
                 unit[1] * __builtin_convertvector(at1, Float8));
  }
  WARMFRONT_INLINE void see(Short16 at0, Short16 at1) {
    const Float8 low = open(((Int8)at0 << 16) >> 16, ((Int8)at1 << 16) >> 16);
    const Float8 high = open((Int8)at0 >> 16, (Int8)at1 >> 16);
    widest = greater(greater(low, high), widest);
  }
  // Nobody asks in another step what was near up to some time of this one: none is unsure.
  WARMFRONT_INLINE Short16 result() const {
    constexpr Short16 kOpen = Short16{} + 1;
    constexpr Short16 kShut = Short16{} - GridPair<Aabb>::kSlack;
    return (Short16)(widest > 0.0F) != 0 ? kOpen : kShut;
  }
};

// One item against each slot of eight; each number stands twice in its slot.
struct Row {
  Short16 open;  // positive where they are apart
  Short16 gap;   // at t = 1, along the axis along which it is widest (half of it along a diagonal)
};

// Eight by end of the step: rows of 16 numbers, by axis.
using RowsAt = std::array<const std::int16_t*, 2>;

template <class Bounds>
WARMFRONT_INLINE RowsAt rows_at(const EightBounds<Bounds>& eight, std::uint32_t begin_at_1) {
  return {row_of(eight, begin_at_1, 0, 0), row_of(eight, begin_at_1, 1, 0)};
}

// `one` is a function from end and axis to a pair, in all slots, whose low number meets the low ones of
// `eight`.
template <class Bounds, class Open, class One>
WARMFRONT_INLINE Row against(Open open, const RowsAt& eight, One&& one) {
  Short16 straight = Short16{} + std::numeric_limits<std::int16_t>::min();
  Short16 diagonal = straight;
#pragma GCC unroll 9
  for (std::size_t k = 0; k < Bounds::kAxes; ++k) {
    const Short16 at0 = one(0, k) + load<Short16>(eight[0] + 16 * k);
    const Short16 at1 = one(1, k) + load<Short16>(eight[1] + 16 * k);
    open.see(at0, at1);
    Short16& widest = k < 3 ? straight : diagonal;
    widest = greater(at1, widest);
  }
  return {open.result(), larger_of(greater(straight, diagonal >> 1))};
}

WARMFRONT_INLINE std::uint64_t all_ored(Int8 slots) {
  const auto words = (Long4)slots;
  return static_cast<std::uint64_t>((words[0] | words[1]) | (words[2] | words[3]));
}
WARMFRONT_INLINE bool any(Int8 slots) {
  return all_ored(slots) != 0;
}

// One bit a slot.
WARMFRONT_INLINE std::uint32_t bits_of(Int8 slots) {
  const std::uint64_t both = all_ored(slots & kLaneBit);
  return static_cast<std::uint32_t>(both | (both >> 32));
}

// Byte j is slot j. Most often there is nothing to pack.
WARMFRONT_INLINE std::uint64_t bytes_of(Int8 slots) {
  if (!any(slots)) return 0;
  const Byte8 bytes = __builtin_convertvector(slots, Byte8);
  std::uint64_t packed;
  std::memcpy(&packed, &bytes, sizeof packed);
  return packed;
}

// Of numbers that stand twice in each slot.
WARMFRONT_INLINE std::int16_t least(Short16 v) {
  const auto shuffled = [&](Int8 by) { return (Short16)__builtin_shuffle((Int8)v, by); };
  v = lesser(v, shuffled(Int8{4, 5, 6, 7, 0, 1, 2, 3}));
  v = lesser(v, shuffled(Int8{2, 3, 0, 1, 6, 7, 4, 5}));
  v = lesser(v, shuffled(Int8{1, 0, 3, 2, 5, 4, 7, 6}));
  return v[0];
}

// Rows of t = 0, then of t = 1.
template <class Bounds>
struct Rows {
  alignas(32) std::array<std::array<std::int16_t, 16>, EightBounds<Bounds>::kRows> row;

  WARMFRONT_INLINE std::int16_t* at(std::size_t t, std::size_t axis) {
    return row[t * Bounds::kAxes + axis].data();
  }
  WARMFRONT_INLINE RowsAt both() { return {at(0, 0), at(1, 0)}; }
};

// The numbers of `a` as those of `b` are to meet them: in common units, lower and upper ends in each other's
// place, and what lies between the leaves added.
template <class Bounds>
WARMFRONT_INLINE void bring_over(const EightBounds<Bounds>& a, const GridPair<Bounds>& between,
                                 Rows<Bounds>& over) {
  const RowsAt rows = rows_at(a, between.begin_at_1_of_a);
#pragma GCC unroll 2
  for (std::size_t t = 0; t < 2; ++t) {
    const auto shift = static_cast<std::int16_t>(between.shift_a[t]);
#pragma GCC unroll 9
    for (std::size_t k = 0; k < Bounds::kAxes; ++k) {
      const Short16 units = load<Short16>(rows[t] + 16 * k) >> shift;
      const Short16 moved = swapped(units) + in_all(between.offset[t * Bounds::kAxes + k]);
      std::memcpy(over.at(t, k), &moved, sizeof moved);
    }
  }
}

// Rows in common units.
template <class Bounds>
WARMFRONT_INLINE void shift_right(const RowsAt& rows, const std::array<std::int32_t, 2>& by,
                                  Rows<Bounds>& to) {
  for (std::size_t t = 0; t < 2; ++t) {
    for (std::size_t k = 0; k < Bounds::kAxes; ++k) {
      const Short16 units = load<Short16>(rows[t] + 16 * k) >> static_cast<std::int16_t>(by[t]);
      std::memcpy(to.at(t, k), &units, sizeof units);
    }
  }
}

// The primitives of `b` that share a vertex with primitive i of `a`.
template <class Bounds>
WARMFRONT_INLINE Int8 sharing(const LeafBlock<Bounds>& a, int i, const LeafBlock<Bounds>& b) {
  Int8 shared{};
  for (int p = 0; p < 3; ++p) {
    const auto vertex = static_cast<std::int32_t>(a.vertex[p][i]);
    for (int q = 0; q < 3; ++q) {
      Int8 others;
      std::memcpy(&others, b.vertex[q].data(), sizeof others);
      shared |= others == vertex;
    }
  }
  return shared;
}

// Of the primitives of `b` that are near one of `a`, those that share no vertex with it; their gap counts.
// The others go into `adjacent`.
template <class Bounds>
WARMFRONT_INLINE Int8 sift(const LeafBlock<Bounds>& a, int i, const LeafBlock<Bounds>& b, Int8 near,
                           Short16 their_gap, Short16& gap, Int8& adjacent) {
  const Int8 shared = near & sharing(a, i, b);
  adjacent |= shared;
  const Int8 free = near & ~shared;
  gap = lesser((Short16)free != 0 ? their_gap : kFar, gap);
  return free;
}

// Blocks that are near are looked into, and their primitives tell the gap.
template <class Bounds>
WARMFRONT_INLINE Int8 sift(const EightBounds<Bounds>&, int, const EightBounds<Bounds>&, Int8 near, Short16,
                           Short16&, Int8&) {
  return near;
}

// With `same`, item i of a meets those of b from i + `beyond` on.
template <class Bounds, class Open, class Eight>
WARMFRONT_INLINE EightOverlaps all_pairs(Open open, const Eight& a, const Eight& b,
                                         const GridPair<Bounds>& between, OneOfLeaf whole_b, bool same,
                                         int beyond) {
  Rows<Bounds> over;
  bring_over(a, between, over);
  Rows<Bounds> shifted;
  const bool finer = (between.shift_b[0] | between.shift_b[1]) != 0;
  RowsAt of_b = rows_at(b, between.begin_at_1_of_b);
  if (finer) {
    shift_right<Bounds>(of_b, between.shift_b, shifted);
    of_b = shifted.both();
  }

  const Int8 used = kSlot < static_cast<std::int32_t>(b.count);
  Short16 gap = kFar;
  std::uint32_t rows = (1U << a.count) - 1;
  if (!same) {
    // The items of `a` that are apart from the whole of b: their gap to that is what counts.
    const Row row = against<Bounds>(open, over.both(), [&](std::size_t t, std::size_t k) {
      return in_all(whole_b(t, k)) >> static_cast<std::int16_t>(between.shift_b[t]);
    });
    const Int8 out = (Int8)(row.open > 0) & (kSlot < static_cast<std::int32_t>(a.count));
    gap = (Short16)out != 0 ? row.gap : gap;
    rows &= ~bits_of(out);
  }
  Int8 to_test{};
  Int8 unsure{};
  Int8 adjacent{};
  for (; rows != 0; rows &= rows - 1) {
    const int i = std::countr_zero(rows);
    const auto bit = static_cast<std::int32_t>(rows & -rows);
    const Int8 wanted = same ? used & (kSlot >= i + beyond) : used;
    const Row row = against<Bounds>(
        open, of_b, [&](std::size_t t, std::size_t k) { return in_all(over.at(t, k) + 2 * i); });
    const Int8 apart = wanted & (Int8)(row.open > 0);
    gap = lesser((Short16)apart != 0 ? row.gap : kFar, gap);
    Int8 near = wanted & ~apart;
    if (!any(near)) continue;  // most rows: what shares a vertex is never apart
    near = sift(a, i, b, near, row.gap, gap, adjacent) & bit;
    to_test |= near;
    unsure |= near & (Int8)(row.open > -GridPair<Bounds>::kSlack);
  }
  const std::int16_t nearest = least(gap);
  return {bytes_of(to_test), bytes_of(unsure),
          nearest == kFarthest ? std::numeric_limits<float>::max()
                               : static_cast<float>(nearest) * between.unit[1],
          any(adjacent)};
}

template <class Bounds, class Eight>
WARMFRONT_INLINE EightOverlaps overlaps(const Eight& a, const Eight& b, const GridPair<Bounds>& between,
                                        OneOfLeaf whole_b, bool same, int beyond, float until) {
  return until < 1 ? all_pairs(OpenUntil{{until}, between.unit}, a, b, between, whole_b, same, beyond)
                   : all_pairs(OpenThroughout{}, a, b, between, whole_b, same, beyond);
}

}  // namespace

WARMFRONT_TARGET_CLONES
EightOverlaps primitive_overlaps(const LeafBlock<Aabb>& a, const LeafBlock<Aabb>& b,
                                 const GridPair<Aabb>& between, OneOfLeaf whole_b, bool same, float until) {
  return overlaps(a, b, between, whole_b, same, 1, until);
}

WARMFRONT_TARGET_CLONES
EightOverlaps primitive_overlaps(const LeafBlock<KDop18>& a, const LeafBlock<KDop18>& b,
                                 const GridPair<KDop18>& between, OneOfLeaf whole_b, bool same, float until) {
  return overlaps(a, b, between, whole_b, same, 1, until);
}

WARMFRONT_TARGET_CLONES
EightOverlaps block_overlaps(const EightBounds<Aabb>& a, const EightBounds<Aabb>& b,
                             const GridPair<Aabb>& between, OneOfLeaf whole_b, bool same, float until) {
  return overlaps(a, b, between, whole_b, same, 0, until);
}

WARMFRONT_TARGET_CLONES
EightOverlaps block_overlaps(const EightBounds<KDop18>& a, const EightBounds<KDop18>& b,
                             const GridPair<KDop18>& between, OneOfLeaf whole_b, bool same, float until) {
  return overlaps(a, b, between, whole_b, same, 0, until);
}

WARMFRONT_TARGET_CLONES
GridPair<Aabb> grid_pair(const LeafGrid<Aabb>& a, const LeafGrid<Aabb>& b) {
  return GridPair<Aabb>::of(a, b);
}

WARMFRONT_TARGET_CLONES
GridPair<KDop18> grid_pair(const LeafGrid<KDop18>& a, const LeafGrid<KDop18>& b) {
  return GridPair<KDop18>::of(a, b);
}

}  // namespace warmfront

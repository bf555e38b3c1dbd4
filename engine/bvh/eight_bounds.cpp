// SPDX-License-Identifier: Apache-2.0
#include "engine/bvh/eight_bounds.h"

#include <bit>
#include <cstring>
#include <limits>

#include "engine/bvh/open_gaps.h"

namespace warmfront {
namespace {

constexpr Int8 kSlot{0, 1, 2, 3, 4, 5, 6, 7};
constexpr std::int16_t kFarthest = std::numeric_limits<std::int16_t>::max();
constexpr Short16 kFar = Short16{} + kFarthest;

// A pair of 16-bit numbers in all eight slots.
WARMFRONT_INLINE Short16 in_all(std::int32_t pair) {
  return (Short16)(Int8{} + pair);
}
WARMFRONT_INLINE Short16 in_all(const std::int16_t* pair) {
  std::int32_t both;
  std::memcpy(&both, pair, sizeof both);
  return in_all(both);
}

// Hides the pointer's origin from the compiler, which would otherwise keep the data and all derived addresses
// on the stack for the whole loop.
WARMFRONT_INLINE const std::int16_t* unknown(const std::int16_t* pointer) {
#if defined(__GNUC__)
  asm("" : "+r"(pointer));
#endif
  return pointer;
}

// One item against each of eight slots; each number occupies both halves of its slot.
struct Row {
  Short16 open;  // positive where they are apart
  Short16 gap;  // at the end asked for, along the axis along which it is widest (half of it along a diagonal)
};

// Eight, by end of the step: rows of 16 numbers, by axis.
using RowsAt = std::array<const std::int16_t*, 2>;

template <class Bounds>
WARMFRONT_INLINE RowsAt rows_at(const EightBounds<Bounds>& eight, std::uint32_t begin_at_1) {
  return {row_of(eight, begin_at_1, 0, 0), row_of(eight, begin_at_1, 1, 0)};
}

// `one(end, axis)` gives a pair in all slots, whose low number meets the low ones of `eight`.
template <class Bounds, GapAt kGapAt, class Open, class One>
WARMFRONT_INLINE Row against(Open open, const RowsAt& eight, One&& one) {
  Short16 straight = Short16{} + std::numeric_limits<std::int16_t>::min();
  Short16 diagonal = straight;
#pragma GCC unroll 9
  for (std::size_t k = 0; k < Bounds::kAxes; ++k) {
    const Short16 at0 = one(0, k) + load<Short16>(eight[0] + 16 * k);
    const Short16 at1 = one(1, k) + load<Short16>(eight[1] + 16 * k);
    open.see(at0, at1);
    Short16& widest = k < 3 ? straight : diagonal;
    widest = greater(kGapAt == GapAt::kEnd ? at1 : at0, widest);
  }
  return {open.result(), larger_of(greater(straight, diagonal >> 1))};
}

// Byte j is slot j. Usually no bit is set.
WARMFRONT_INLINE std::uint64_t bytes_of(Int8 slots) {
  if (!any(slots)) return 0;
  const Byte8 bytes = to_bytes(slots);
  std::uint64_t packed;
  std::memcpy(&packed, &bytes, sizeof packed);
  return packed;
}

// The least number; each occurs twice in its slot.
WARMFRONT_INLINE std::int16_t least(Short16 v) {
  v = lesser(v, (Short16)shuffle<4, 5, 6, 7, 0, 1, 2, 3>((Int8)v, (Int8)v));
  v = lesser(v, (Short16)shuffle<2, 3, 0, 1, 6, 7, 4, 5>((Int8)v, (Int8)v));
  v = lesser(v, (Short16)shuffle<1, 0, 3, 2, 5, 4, 7, 6>((Int8)v, (Int8)v));
  return v[0];
}

template <class Bounds>
WARMFRONT_INLINE void rebase_all(const EightBounds<Bounds>& a, const GridPair<Bounds>& between,
                                 Rebased<Bounds>& over) {
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

// Shifts rows to common units.
template <class Bounds>
WARMFRONT_INLINE void shift_right(const RowsAt& rows, const std::array<std::int32_t, 2>& by,
                                  Rebased<Bounds>& to) {
  for (std::size_t t = 0; t < 2; ++t) {
    for (std::size_t k = 0; k < Bounds::kAxes; ++k) {
      const Short16 units = load<Short16>(rows[t] + 16 * k) >> static_cast<std::int16_t>(by[t]);
      std::memcpy(to.at(t, k), &units, sizeof units);
    }
  }
}

// Two policies for which pairs exist: per row, the slots of b that item i of a is paired with, and which of
// these determine the gap.

// Primitives: all pairs determine the gap.
struct Primitives {
  std::uint64_t excluded;

  WARMFRONT_INLINE Int8 meets(int i) const {
    return ((Int8{} + static_cast<std::int32_t>((excluded >> (8 * i)) & 0xff)) & kLaneBit) == 0;
  }
  // The rows that have a pair.
  WARMFRONT_INLINE std::uint32_t rows() const {
    std::uint64_t full = excluded & (excluded >> 4) & 0x0f0f0f0f0f0f0f0f;
    full &= full >> 2;
    full &= (full >> 1) & 0x0101010101010101;
    return ~static_cast<std::uint32_t>((full * 0x0102040810204080) >> 56) & 0xff;
  }
  WARMFRONT_INLINE static Short16 gap(Int8 meets, Int8, Short16 of_row) {
    return select((Short16)meets != 0, of_row, kFar);
  }
};

// Blocks: overlapping pairs are opened, and their primitives determine the gap.
struct Blocks {
  BlockCounts counts;

  WARMFRONT_INLINE Int8 meets(int i) const {
    const Int8 used = kSlot < static_cast<std::int32_t>(counts.b);
    return counts.same ? used & (kSlot >= i) : used;
  }
  WARMFRONT_INLINE std::uint32_t rows() const { return (1U << counts.a) - 1; }
  WARMFRONT_INLINE static Short16 gap(Int8, Int8 apart, Short16 of_row) {
    return select((Short16)apart != 0, of_row, kFar);
  }
};

template <class Bounds, GapAt kGapAt, class Open, class Pairs>
WARMFRONT_INLINE EightOverlaps all_pairs(Open open, const Rebased<Bounds>& over, const EightBounds<Bounds>& b,
                                         const GridPair<Bounds>& between, const OneOfLeaf* whole_b,
                                         Pairs pairs) {
  Rebased<Bounds> shifted;
  const bool finer = (between.shift_b[0] | between.shift_b[1]) != 0;
  RowsAt of_b = rows_at(b, between.begin_at_1_of_b);
  if (finer) {
    shift_right<Bounds>(of_b, between.shift_b, shifted);
    of_b = {shifted.at(0, 0), shifted.at(1, 0)};
  }

  Short16 gap = kFar;
  std::uint32_t rows = pairs.rows();
  if (whole_b != nullptr) {
    // The items of `a` that are apart from the whole of b: their gap to that is what counts.
    const Row row =
        against<Bounds, kGapAt>(open, {over.at(0, 0), over.at(1, 0)}, [&](std::size_t t, std::size_t k) {
          return in_all((*whole_b)(t, k)) >> static_cast<std::int16_t>(between.shift_b[t]);
        });
    const Int8 looked_at = ((Int8{} + static_cast<std::int32_t>(rows)) & kLaneBit) != 0;
    const Int8 out = (Int8)(row.open > 0) & looked_at;
    gap = select((Short16)out != 0, row.gap, gap);
    rows &= ~bits_of(out);
  }
  Int8 to_test{};
  Int8 unsure{};
  for (; rows != 0; rows &= rows - 1) {
    const int i = std::countr_zero(rows);
    const auto bit = static_cast<std::int32_t>(rows & -rows);
    const Int8 meets = pairs.meets(i);
    const std::int16_t* item = unknown(over.at(0, 0) + 2 * i);
    const Row row = against<Bounds, kGapAt>(
        open, {unknown(of_b[0]), unknown(of_b[1])},
        [&](std::size_t t, std::size_t k) { return in_all(item + 16 * (t * Bounds::kAxes + k)); });
    const Int8 apart = meets & (Int8)(row.open > 0);
    gap = lesser(pairs.gap(meets, apart, row.gap), gap);
    const Int8 near = meets & ~apart & bit;
    to_test |= near;
    unsure |= near & (Int8)(row.open > -GridPair<Bounds>::kSlack);
  }
  const std::int16_t nearest = least(gap);
  return {bytes_of(to_test), bytes_of(unsure),
          nearest == kFarthest ? std::numeric_limits<float>::max()
                               : static_cast<float>(nearest) * between.unit[kGapAt == GapAt::kEnd ? 1 : 0] + between.lacks};
}

template <class Bounds, class Open, class Pairs>
WARMFRONT_INLINE EightOverlaps all_pairs(Open open, const Rebased<Bounds>& over, const EightBounds<Bounds>& b,
                                         const GridPair<Bounds>& between, const OneOfLeaf* whole_b,
                                         Pairs pairs, GapAt gap_at) {
  return gap_at == GapAt::kStart ? all_pairs<Bounds, GapAt::kStart>(open, over, b, between, whole_b, pairs)
                                 : all_pairs<Bounds, GapAt::kEnd>(open, over, b, between, whole_b, pairs);
}

template <class Bounds, class Pairs>
WARMFRONT_INLINE EightOverlaps overlaps(const Rebased<Bounds>& over, const EightBounds<Bounds>& b,
                                        const GridPair<Bounds>& between, const OneOfLeaf* whole_b,
                                        Pairs pairs, float until, GapAt gap_at) {
  if (!(until < 1)) return all_pairs(OpenThroughout{}, over, b, between, whole_b, pairs, gap_at);
  const std::int16_t soon = OpenSoon::least_for(until, between);
  if (soon > 0 && (soon <= OpenSoon::kFew || !between.tells_gaps_at_1()))
    return all_pairs(OpenSoon{soon}, over, b, between, whole_b, pairs, gap_at);
  return between.tells_gaps_at_1()
             ? all_pairs(OpenUntil{{until}, between.unit}, over, b, between, whole_b, pairs, gap_at)
             : all_pairs(OpenThroughout{}, over, b, between, whole_b, pairs, gap_at);
}

template <class Bounds>
WARMFRONT_INLINE EightOverlaps overlaps_of_blocks(const EightBounds<Bounds>& a, const EightBounds<Bounds>& b,
                                                  BlockCounts counts, const GridPair<Bounds>& between,
                                                  const OneOfLeaf& whole_b, float until, GapAt gap_at) {
  Rebased<Bounds> over;
  rebase_all(a, between, over);
  return overlaps(over, b, between, counts.same ? nullptr : &whole_b, Blocks{counts}, until, gap_at);
}

}  // namespace

WARMFRONT_TARGET_CLONES
std::uint32_t first_corners(const EightCorners& corners) {
  std::uint32_t repeated = 0;
  for (std::uint32_t k = 0; k < 3; ++k) {
    for (std::uint32_t i = 0; i < 8; ++i) {
      const auto vertex = static_cast<std::int32_t>(corners.vertex[k][i]);
      for (std::uint32_t row = k; row < 3; ++row) {
        std::uint32_t same = bits_of(load<Int8>(corners.vertex[row].data()) == vertex);
        if (row == k) same &= 0xFEU << i;
        repeated |= (same & 0xFFU) << (8 * row);
      }
    }
  }
  return ~repeated & 0xFFFFFFU;
}

WARMFRONT_TARGET_CLONES
std::uint64_t sharing_pairs(const EightCorners& a, const EightCorners& b) {
  std::uint64_t pairs = 0;
  for (std::uint32_t i = 0; i < 8; ++i) {
    Int8 shared{};
    for (const auto& p : a.vertex) {
      for (const auto& q : b.vertex) shared |= load<Int8>(q.data()) == static_cast<std::int32_t>(p[i]);
    }
    pairs |= std::uint64_t{bits_of(shared)} << (8 * i);
  }
  return pairs;
}

WARMFRONT_TARGET_CLONES
void rebase(const EightBounds<Aabb>& a, const GridPair<Aabb>& between, Rebased<Aabb>& over) {
  rebase_all(a, between, over);
}

WARMFRONT_TARGET_CLONES
void rebase(const EightBounds<KDop18>& a, const GridPair<KDop18>& between, Rebased<KDop18>& over) {
  rebase_all(a, between, over);
}

WARMFRONT_TARGET_CLONES
EightOverlaps primitive_overlaps(const Rebased<Aabb>& over, const EightBounds<Aabb>& b,
                                 const GridPair<Aabb>& between, const OneOfLeaf* whole_b,
                                 std::uint64_t excluded, float until, GapAt gap_at) {
  return overlaps<Aabb>(over, b, between, whole_b, Primitives{excluded}, until, gap_at);
}

WARMFRONT_TARGET_CLONES
EightOverlaps primitive_overlaps(const Rebased<KDop18>& over, const EightBounds<KDop18>& b,
                                 const GridPair<KDop18>& between, const OneOfLeaf* whole_b,
                                 std::uint64_t excluded, float until, GapAt gap_at) {
  return overlaps<KDop18>(over, b, between, whole_b, Primitives{excluded}, until, gap_at);
}

WARMFRONT_TARGET_CLONES
EightOverlaps block_overlaps(const EightBounds<Aabb>& a, const EightBounds<Aabb>& b, BlockCounts counts,
                             const GridPair<Aabb>& between, OneOfLeaf whole_b, float until, GapAt gap_at) {
  return overlaps_of_blocks(a, b, counts, between, whole_b, until, gap_at);
}

WARMFRONT_TARGET_CLONES
EightOverlaps block_overlaps(const EightBounds<KDop18>& a, const EightBounds<KDop18>& b, BlockCounts counts,
                             const GridPair<KDop18>& between, OneOfLeaf whole_b, float until, GapAt gap_at) {
  return overlaps_of_blocks(a, b, counts, between, whole_b, until, gap_at);
}

WARMFRONT_TARGET_CLONES
GridPair<Aabb> grid_pair(const LeafGrid<Aabb>& a, const LeafGrid<Aabb>& b, const Width& width) {
  return GridPair<Aabb>::of(a, b, width);
}

WARMFRONT_TARGET_CLONES
GridPair<KDop18> grid_pair(const LeafGrid<KDop18>& a, const LeafGrid<KDop18>& b, const Width& width) {
  return GridPair<KDop18>::of(a, b, width);
}

}  // namespace warmfront

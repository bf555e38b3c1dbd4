// SPDX-License-Identifier: Apache-2.0
// The bounds below a leaf side by side, so that one is tested against eight of another leaf at once:
// primitives in blocks, and blocks in leaves that hold more than one. Written by refit, read by all threads
// for the remaining step.
#pragma once

#include <array>
#include <cstdint>

#include "engine/bounds/kdop.h"
#include "engine/bounds/overlap.h"
#include "engine/bvh/leaf_grid.h"
#include "engine/simd/target_clones.h"

namespace warmfront {

/// Up to eight bounds in their leaf's numbers (leaf_grid.h), by end and axis; each as its lower end and,
/// beside it, its negated upper end. Whole cache lines, all of which a test reads, and nothing else: the
/// count and the primitives' numbers are stored elsewhere (Bvh).
template <class Bounds>
struct EightBounds {
  static constexpr std::uint32_t kSlots = 8;
  static constexpr std::uint32_t kAxes = Bounds::kAxes;
  static constexpr std::size_t kRows = std::size_t{2} * kAxes;
  /// In a hierarchy, empty slots repeat the first.
  alignas(64) std::array<std::array<std::int16_t, 2 * kSlots>, kRows> row;
};
static_assert(sizeof(EightBounds<KDop18>) == 9 * 64);

/// The row of an end of the step (0 or 1) and axis; the leaf's grid says where t = 1 begins.
template <class Bounds>
WARMFRONT_INLINE const std::int16_t* row_of(const EightBounds<Bounds>& eight, std::uint32_t begin_at_1,
                                            std::size_t t, std::size_t axis) {
  return eight.row[(t == 1 ? begin_at_1 : Bounds::kAxes - begin_at_1) + axis].data();
}

/// The vertices of up to eight primitives, by corner and slot: written once for an order of primitives, read
/// by refit, and by sharing_pairs() where SharedVertices is not available. An isolated vertex is stored three
/// times; empty slots repeat the first primitive.
struct alignas(32) EightCorners {
  std::array<std::array<std::uint32_t, 8>, 3> vertex;
};

/// The corners, bit 8 k + i for corner k of slot i, whose vertex no bit below stands for: each vertex once.
std::uint32_t first_corners(const EightCorners& corners);

/// One bounds within a leaf: one of eight, or the leaf as a whole.
struct OneOfLeaf {
  std::array<const std::int16_t*, 2> first;  ///< by end of the step
  std::size_t stride;

  template <class Bounds>
  WARMFRONT_INLINE static OneOfLeaf of(const EightBounds<Bounds>& eight, std::uint32_t begin_at_1,
                                       std::uint32_t slot) {
    return {{row_of(eight, begin_at_1, 0, 0) + 2 * slot, row_of(eight, begin_at_1, 1, 0) + 2 * slot},
            2 * eight.kSlots};
  }
  template <class Bounds>
  WARMFRONT_INLINE static OneOfLeaf of(const LeafGrid<Bounds>& leaf) {
    return {{leaf.whole[0].data(), leaf.whole[leaf.kAxes].data()}, 2};
  }
  /// Its lower end and its negated upper end.
  WARMFRONT_INLINE const std::int16_t* operator()(std::size_t t, std::size_t axis) const {
    return first[t] + axis * stride;
  }
};

/// Bit 8 j + i stands for slot i of a and slot j of b.
struct EightOverlaps {
  std::uint64_t to_test;
  /// Those overlaps whose bounds in float32 might still be apart.
  std::uint64_t unsure;
  float gap;
};

/// The pairs of slots whose primitives share a vertex, bit 8 i + j for slot i of a and slot j of b: the same
/// as SharedVertices, computed from the corners.
std::uint64_t sharing_pairs(const EightCorners& a, const EightCorners& b);

/// One block's numbers, converted for tests against another leaf's blocks: in common units, lower and upper
/// ends swapped, and the offset between the leaves added. Rows of t = 0, then of t = 1.
template <class Bounds>
struct Rebased {
  alignas(32) std::array<std::array<std::int16_t, 16>, EightBounds<Bounds>::kRows> row;

  WARMFRONT_INLINE const std::int16_t* at(std::size_t t, std::size_t axis) const {
    return row[t * Bounds::kAxes + axis].data();
  }
  WARMFRONT_INLINE std::int16_t* at(std::size_t t, std::size_t axis) {
    return row[t * Bounds::kAxes + axis].data();
  }
};

/// Converts a block of the first leaf of `between` for the second.
void rebase(const EightBounds<Aabb>& a, const GridPair<Aabb>& between, Rebased<Aabb>& over);
void rebase(const EightBounds<KDop18>& a, const GridPair<KDop18>& between, Rebased<KDop18>& over);

/// All slots of block a, converted as `over`, against all of block `b`, except the pairs in `excluded`, bit 8
/// i + j for slot i of a and slot j of b. `whole_b` bounds b as a whole, null when a and b are one block.
/// `between` relates a's leaf to b's. Returns the pairs whose moving bounds are within its width of each other,
/// where an empty slot counts as its block's first (Bvh); `gap` is the distance at `gap_at` of the nearest two,
/// as separation() measures it, or less; not positive when some overlap then. Only the part of the step up to the time
/// `until` counts; 1 or more: all of it.
EightOverlaps primitive_overlaps(const Rebased<Aabb>& over, const EightBounds<Aabb>& b,
                                 const GridPair<Aabb>& between, const OneOfLeaf* whole_b,
                                 std::uint64_t excluded, float until, GapAt gap_at = GapAt::kEnd);
EightOverlaps primitive_overlaps(const Rebased<KDop18>& over, const EightBounds<KDop18>& b,
                                 const GridPair<KDop18>& between, const OneOfLeaf* whole_b,
                                 std::uint64_t excluded, float until, GapAt gap_at = GapAt::kEnd);

/// Number of blocks of each of two leaves to be tested against each other. With `same` each pair once, i <=
/// j, and a block overlaps itself.
struct BlockCounts {
  std::uint32_t a;
  std::uint32_t b;
  bool same;
};
/// The same for the blocks of two leaves. The gap is that of the nearest two that are not within the width.
EightOverlaps block_overlaps(const EightBounds<Aabb>& a, const EightBounds<Aabb>& b, BlockCounts counts,
                             const GridPair<Aabb>& between, OneOfLeaf whole_b, float until,
                             GapAt gap_at = GapAt::kEnd);
EightOverlaps block_overlaps(const EightBounds<KDop18>& a, const EightBounds<KDop18>& b, BlockCounts counts,
                             const GridPair<KDop18>& between, OneOfLeaf whole_b, float until,
                             GapAt gap_at = GapAt::kEnd);

/// The relation between the numbers of two leaves, for a question of this width. Tests of a part of the step
/// tell more apart with GridPair::learn_end().
GridPair<Aabb> grid_pair(const LeafGrid<Aabb>& a, const LeafGrid<Aabb>& b, const Width& width = {});
GridPair<KDop18> grid_pair(const LeafGrid<KDop18>& a, const LeafGrid<KDop18>& b, const Width& width = {});

}  // namespace warmfront

// SPDX-License-Identifier: Apache-2.0
// From two blocks of leaves to the primitive pairs between them. Used by one thread at a time.
#pragma once

#include <bit>
#include <cstdint>
#include <span>
#include <utility>

#include "engine/bounds/overlap.h"
#include "engine/bvh/bvh.h"
#include "engine/narrow_phase/pair_tester.h"

namespace warmfront {

template <class Bounds>
class BlockPairs {
 public:
  /// Passes primitive pairs to `tester`.
  explicit BlockPairs(PairTester& tester) : tester_(tester) {}

  void begin(const NarrowPhaseInput& input) {
    scene_ = &input.scene;
    vertex_bounds_ = input.vertex_bounds;
    gap_at_ = input.gap_at;
  }

  /// The next blocks belong to leaves of these hierarchies, related by `between`, of this width, which must
  /// outlive their tests.
  void begin_leaves(const Bvh<Bounds>& a, const Bvh<Bounds>& b, const GridPair<Bounds>& between,
                    const Width& width) {
    width_ = width;
    between_ = &between;
    rebased_ = nullptr;
    always_empty_ = no_pairs(a.shape.largest_block(), b.shape.largest_block(), false);
  }

  /// Tests all primitives of two blocks against each other, except the pairs in `excluded` (Bvh::excluded()).
  /// `whole_b` bounds the second one as a whole; null if they are one block. Returns the gap of
  /// primitive_overlaps().
  float test(const Bvh<Bounds>& a, BlockId block_a, const Bvh<Bounds>& b, BlockId block_b,
             std::uint64_t excluded, const OneOfLeaf* whole_b) {
    excluded |= always_empty_;
    const EightBounds<Bounds>& eight_a = a.leaves.blocks[number_of(block_a)];
    if (std::exchange(rebased_, &eight_a) != &eight_a) rebase(eight_a, *between_, over_);
    const EightOverlaps pairs = primitive_overlaps(over_, b.leaves.blocks[number_of(block_b)], *between_,
                                                   whole_b, excluded, tester_.until(), gap_at_);
    tester_.output().counts.primitive_tests += static_cast<std::uint64_t>(std::popcount(~excluded));
    if (pairs.to_test != 0) test_found(a, block_a, b, block_b, pairs);
    return pairs.gap;
  }

  /// Pairs of two blocks' slots that must not be tested.
  static std::uint64_t excluded(const Bvh<Bounds>& a, BlockId block_a, const Bvh<Bounds>& b,
                                BlockId block_b) {
    return &a == &b ? a.excluded(block_a, block_b) : 0;  // two hierarchies share no vertex
  }

 private:
  void test_found(const Bvh<Bounds>& a, BlockId block_a, const Bvh<Bounds>& b, BlockId block_b,
                  const EightOverlaps& pairs) {
    const std::uint32_t first_a = a.shape.begin_of_block(block_a);
    const std::uint32_t first_b = b.shape.begin_of_block(block_b);
    // `excluded` may omit empty slots, which repeat the block's first.
    const std::uint64_t none = no_pairs(b.shape.begin_of_block(block_b + 1) - first_b,
                                        a.shape.begin_of_block(block_a + 1) - first_a, false);
    for (std::uint64_t bits = pairs.to_test & ~none; bits != 0; bits &= bits - 1) {
      const auto bit = static_cast<std::uint32_t>(std::countr_zero(bits));
      const Primitive p = a.order[first_a + bit % 8];
      const Primitive q = b.order[first_b + bit / 8];
      // So that the counted pairs do not depend on the leaves that they are in.
      if ((bits & -bits & pairs.unsure) != 0 && !bounds_overlap(p, q)) continue;
      tester_.primitive_pair(p, q);
    }
  }

  // Overlap of the float32 bounds.
  bool bounds_overlap(Primitive p, Primitive q) const {
    const auto bounds = [this](Primitive primitive) {
      const auto [a, b, c] = primitive_vertices(*scene_, primitive);
      return TriangleBounds{{&vertex_bounds_[a], &vertex_bounds_[b], &vertex_bounds_[c]}};
    };
    return overlap<Bounds>(bounds(p), bounds(q), width_);
  }

  PairTester& tester_;
  const Scene* scene_ = nullptr;
  std::span<const PointBounds> vertex_bounds_;
  GapAt gap_at_ = GapAt::kEnd;
  Width width_;
  const GridPair<Bounds>* between_ = nullptr;
  std::uint64_t always_empty_ = 0;                // in all blocks of these hierarchies
  const EightBounds<Bounds>* rebased_ = nullptr;  // the block that `over_` was computed from
  Rebased<Bounds> over_;
};

}  // namespace warmfront

// SPDX-License-Identifier: Apache-2.0
// From two blocks of leaves to the primitive pairs between them. Used by one thread at a time.
#pragma once

#include <bit>
#include <cstdint>
#include <span>
#include <utility>

#include "engine/bounds/overlap.h"
#include "engine/bvh/bvh.h"
#include "engine/elementary/pair_tester.h"
#include "engine/front/neighbours.h"

namespace warmfront {

template <class Bounds>
class BlockPairs {
 public:
  /// Takes what it finds to `tester`.
  explicit BlockPairs(PairTester& tester) : tester_(tester) {}

  void begin(const NarrowPhaseInput& input) {
    scene_ = &input.scene;
    vertex_bounds_ = input.vertex_bounds;
  }

  /// The next blocks are of leaves that stand to each other as `between` says, which outlives their tests.
  void begin_leaves(const GridPair<Bounds>& between) {
    between_ = &between;
    brought_ = nullptr;
  }

  /// Tests all primitives of two blocks against each other, but for the pairs that share a vertex, which
  /// `shared` says. `whole_b` bounds b as a whole; null where they are one block. Returns the gap of
  /// primitive_overlaps().
  float test(const Bvh<Bounds>& a, const LeafBlock<Bounds>& block_a, const Bvh<Bounds>& b,
             const LeafBlock<Bounds>& block_b, std::uint64_t shared, const OneOfLeaf* whole_b) {
    const bool same = whole_b == nullptr;
    const std::uint64_t without = shared | no_pairs(block_a.count, block_b.count, same);
    if (std::exchange(brought_, &block_a) != &block_a) bring_over(block_a, *between_, over_);
    const EightOverlaps pairs =
        primitive_overlaps(over_, block_b, *between_, whole_b, without, tester_.until());
    tester_.output().counts.primitive_tests +=
        same ? block_a.count * (block_a.count - 1) / 2 : block_a.count * block_b.count;
    for (std::uint64_t bits = pairs.to_test; bits != 0; bits &= bits - 1) {
      const auto bit = static_cast<std::uint32_t>(std::countr_zero(bits));
      const Primitive p = a.order[block_a.first + bit % 8];
      const Primitive q = b.order[block_b.first + bit / 8];
      // So that which pairs are counted does not depend on the leaves that they are in.
      if ((bits & -bits & pairs.unsure) != 0 && !bounds_overlap(p, q)) continue;
      tester_.primitive_pair(p, q);
    }
    return pairs.gap;
  }

  /// The pairs of two blocks that share a vertex.
  static std::uint64_t sharing(const Bvh<Bounds>& a, const LeafBlock<Bounds>& block_a, const Bvh<Bounds>& b,
                               const LeafBlock<Bounds>& block_b) {
    if (&a != &b) return 0;  // two hierarchies have no vertex in common
    const std::uint32_t at_a = number(a, block_a);
    const std::uint32_t at_b = number(b, block_b);
    return is_known(a, at_a, at_b) ? a.shared->of(at_a, at_b) : sharing_pairs(block_a, block_b);
  }
  /// The same of two that list_neighbours() does not list.
  static std::uint64_t sharing_unlisted(const Bvh<Bounds>& tree, const LeafBlock<Bounds>& a,
                                        const LeafBlock<Bounds>& b) {
    const std::uint32_t at_a = number(tree, a);
    const std::uint32_t at_b = number(tree, b);
    return is_known(tree, at_a, at_b) ? tree.shared->of_no_place(at_a, at_b) : sharing_pairs(a, b);
  }
  /// The same of two that it lists.
  static std::uint64_t sharing_listed(const Bvh<Bounds>& tree, const NeighbourPair& pair) {
    return is_known(tree, pair.a, pair.b) ? tree.shared->at(pair.place)
                                          : sharing_pairs(tree.blocks[pair.a], tree.blocks[pair.b]);
  }

 private:
  static std::uint32_t number(const Bvh<Bounds>& tree, const LeafBlock<Bounds>& block) {
    return static_cast<std::uint32_t>(&block - tree.blocks.data());
  }
  static bool is_known(const Bvh<Bounds>& tree, std::uint32_t a, std::uint32_t b) {
    return tree.shared != nullptr && !(tree.shared->crowded(a) && tree.shared->crowded(b));
  }

  // In float32.
  bool bounds_overlap(Primitive p, Primitive q) const {
    const auto bounds = [this](Primitive primitive) {
      const auto [a, b, c] = primitive_vertices(*scene_, primitive);
      return TriangleBounds{{&vertex_bounds_[a], &vertex_bounds_[b], &vertex_bounds_[c]}};
    };
    return overlap<Bounds>(bounds(p), bounds(q));
  }

  PairTester& tester_;
  const Scene* scene_ = nullptr;
  std::span<const PointBounds> vertex_bounds_;
  const GridPair<Bounds>* between_ = nullptr;
  const LeafBlock<Bounds>* brought_ = nullptr;  // the block that is in `over_`
  BroughtOver<Bounds> over_;
};

}  // namespace warmfront

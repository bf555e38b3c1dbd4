// SPDX-License-Identifier: Apache-2.0
// Depth-first descent of the bounding volume test tree. Reads the hierarchies only; any number of threads may
// descend.
#pragma once

#include <array>
#include <cstdint>
#include <limits>

#include "engine/bounds/overlap.h"
#include "engine/bvh/node_patches.h"
#include "engine/front/leaf_pairs.h"

namespace warmfront {

/// Two parts' hierarchies, or one twice.
template <class Bounds>
struct TreePair {
  const Bvh<Bounds>& a;
  const Bvh<Bounds>& b;

  PatchesOfTwo patches;
  GapAt gap_at;  ///< where gaps are measured, and budgets begin
  Width width;   ///< within which nodes count as overlapping

  /// The gap of two nodes of which no pair of features counts: they never meet.
  static constexpr float kLeftOut = std::numeric_limits<float>::max();

  TreePair(const Bvh<Bounds>& the_a, const Bvh<Bounds>& the_b, GapAt the_end = GapAt::kEnd,
           const Width& the_width = {})
      : a(the_a), b(the_b), patches(a.patches, b.patches), gap_at(the_end), width(the_width) {}

  Bvtt bvtt() const { return {a.shape, b.shape, &a == &b}; }
  /// Union of the two nodes' states.
  MotionState state(const NodePair& pair) const {
    // Most often everything moves, and there is nothing to look up.
    if (a.motion.all_moving || b.motion.all_moving) return kMoving | kChanged;
    return a.motion.states[number_of(pair.a)] | b.motion.states[number_of(pair.b)];
  }
  /// As separation(); kLeftOut in one patch. A node overlaps itself by definition (an empty leaf's bounds
  /// would say no).
  float gap(const NodePair& pair, std::uint64_t& bv_tests) const { return gap(pair, bv_tests, width); }
  float gap(const NodePair& pair, std::uint64_t& bv_tests, const Width& within) const {
    if (patches.are_one(pair.a, pair.b)) return kLeftOut;
    if (&a == &b && pair.a == pair.b) return -1;
    ++bv_tests;
    return separation(a.nodes[number_of(pair.a)], b.nodes[number_of(pair.b)], gap_at, within);
  }
  /// What is kept in hand of a pair's budget.
  std::uint32_t reserve() const { return travel::reserve(a.travel.slack + b.travel.slack, width); }
};

/// Traverses from `from`, whose gap is known. In depth-first order, each pair that the front would hold goes
/// to `disjoint`, with its gap, or, if it is a leaf pair that overlaps, to `leaf_pair`. `bv_tests` counts the
/// overlap tests below `from`.
template <class Bounds, class Disjoint, class LeafPair>
void descend(const TreePair<Bounds>& trees, const NodePair& from, float gap, std::uint64_t& bv_tests,
             Disjoint&& disjoint, LeafPair&& leaf_pair) {
  const Bvtt bvtt = trees.bvtt();
  // A pair opens one level at a time and leaves at most two siblings behind: two nodes of 31 levels at most.
  std::array<NodePair, 192> stack;
  int top = 0;
  const auto visit = [&](const NodePair& pair, float apart) {
    if (apart > 0) {
      disjoint(pair, apart);
    } else if (bvtt.is_leaf(pair)) {
      leaf_pair(pair);
    } else {
      std::array<NodePair, 3> children;
      int count = 0;
      bvtt.for_children(pair, [&](const NodePair& child) { children[count++] = child; });
      while (count > 0) stack[top++] = children[--count];
    }
  };
  visit(from, gap);
  while (top > 0) {
    const NodePair pair = stack[--top];
    visit(pair, trees.gap(pair, bv_tests));
  }
}

}  // namespace warmfront

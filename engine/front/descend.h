// SPDX-License-Identifier: Apache-2.0
// Depth-first descent of the bounding volume test tree. Reads the hierarchy only; any number of threads may
// descend.
#pragma once

#include <array>
#include <cstdint>

#include "engine/bounds/overlap.h"
#include "engine/front/leaf_pairs.h"
#include "engine/front/node_pair.h"

namespace warmfront {

/// Calls `visit` for the children of `pair` (which is no leaf pair), in order.
template <class Visit>
void for_children(const NodePair& pair, Visit&& visit) {
  const NodeId left = TreeShape::left(pair.a);
  if (pair.a == pair.b) {
    visit(NodePair{left, left});
    visit(NodePair{left + 1, left + 1});
    visit(NodePair{left, left + 1});
  } else {
    visit(ordered(left, pair.b));
    visit(ordered(left + 1, pair.b));
  }
}

/// Traverses from `from`, whose separation() `gap` is known. In depth-first order, `terminal` is called with
/// each pair that the front would hold and its gap: disjoint pairs with their separation, and leaf pairs that
/// overlap with what `sink`, to which they go first, says. `bv_tests` counts the overlap tests below `from`.
template <class Bounds, class Terminal>
void descend_from(const Bvh<Bounds>& bvh, const NodePair& from, float gap, std::uint64_t& bv_tests,
                  LeafPairSink& sink, Terminal&& terminal) {
  // A pair opens one level at a time and leaves at most two siblings behind: two nodes of 31 levels at most.
  std::array<NodePair, 192> stack;
  int top = 0;
  const auto push_children = [&](const NodePair& pair) {
    std::array<NodePair, 3> children;
    int count = 0;
    for_children(pair, [&](const NodePair& child) { children[count++] = child; });
    while (count > 0) stack[top++] = children[--count];
  };
  const auto visit = [&](const NodePair& pair, float apart) {
    if (apart > 0) {
      terminal(pair, apart);
    } else if (bvh.shape.is_leaf(pair.a)) {  // then b is one too
      terminal(pair, sink.leaf_pair(pair.a, pair.b));
    } else {
      push_children(pair);
    }
  };
  visit(from, gap);
  while (top > 0) {
    const NodePair pair = stack[--top];
    if (pair.a == pair.b) {  // a node overlaps itself by definition: an empty leaf's bounds would say no
      visit(pair, -1);
    } else {
      ++bv_tests;
      visit(pair, separation(bvh.nodes[pair.a], bvh.nodes[pair.b]));
    }
  }
}

/// The same from a pair that is known to overlap.
template <class Bounds, class Terminal>
void descend(const Bvh<Bounds>& bvh, const NodePair& open, std::uint64_t& bv_tests, LeafPairSink& sink,
             Terminal&& terminal) {
  descend_from(bvh, open, -1, bv_tests, sink, terminal);
}

}  // namespace warmfront

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

/// Descends below the children of `open`, a pair known to overlap that is no leaf pair. In depth-first order,
/// `terminal` is called with each pair the front would hold: disjoint pairs, and leaf pairs whether they
/// overlap or not. Leaf pairs that overlap go to `sink` too. `bv_tests` counts the overlap tests.
template <class Bounds, class Terminal>
void descend(const Bvh<Bounds>& bvh, const NodePair& open, std::uint64_t& bv_tests, LeafPairSink& sink,
             Terminal&& terminal) {
  // A pair opens one level at a time and leaves at most two siblings behind: two nodes of 31 levels at most.
  std::array<NodePair, 192> stack;
  int top = 0;
  const auto push_children = [&](const NodePair& pair) {
    std::array<NodePair, 3> children;
    int count = 0;
    for_children(pair, [&](const NodePair& child) { children[count++] = child; });
    while (count > 0) stack[top++] = children[--count];
  };
  push_children(open);
  while (top > 0) {
    const NodePair pair = stack[--top];
    const bool self = pair.a == pair.b;
    if (!self) ++bv_tests;
    const bool overlapping = self || overlap(bvh.nodes[pair.a], bvh.nodes[pair.b]);
    if (bvh.shape.is_leaf(pair.a)) {  // then b is one too
      terminal(pair);
      if (overlapping) sink.leaf_pair(pair.a, pair.b);
    } else if (overlapping) {
      push_children(pair);
    } else {
      terminal(pair);
    }
  }
}

}  // namespace warmfront

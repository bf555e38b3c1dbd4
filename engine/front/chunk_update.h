// SPDX-License-Identifier: Apache-2.0
// Updating one chunk of the front. Used by one thread at a time.
// Source: Tang, Manocha, Tong 2009, section 4.3 (sprouting); pruning as in Ehmann, Lin 2001, made canonical.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "engine/bounds/overlap.h"
#include "engine/front/chunks.h"
#include "engine/front/descend.h"
#include "engine/front/pair_overlaps.h"

namespace warmfront {

template <class Bounds>
class ChunkUpdate {
 public:
  static constexpr std::size_t kPairs = 512;  ///< in a chunk, at most

  ChunkUpdate(const Bvh<Bounds>& bvh, LeafPairSink& sink, ChunkOutputs::Chunk& chunk)
      : bvh_(bvh), sink_(sink), chunk_(chunk) {}

  /// Updates the pairs of a chunk, in order: overlapping ones are opened (leaf pairs handed over); with
  /// `prune`, disjoint ones are folded as far as their ancestors are disjoint, else kept.
  void run(std::span<const NodePair> pairs, bool prune) {
    test(pairs);
    for (std::size_t i = 0; i < pairs.size(); ++i) {
      const NodePair& pair = pairs[i];
      if (overlaps_[i] == 0) {
        prune ? fold(pair) : chunk_.push(pair);
      } else if (bvh_.shape.is_leaf(pair.a)) {
        chunk_.push(pair);
        sink_.leaf_pair(pair.a, pair.b);
      } else {
        ++chunk_.sprouted();
        descend(bvh_, pair, chunk_.bv_tests(), sink_, [this](const NodePair& end) { chunk_.push(end); });
      }
    }
  }

 private:
  // Self pairs overlap by definition (an empty leaf's bounds would say no) and are no tests.
  void test(std::span<const NodePair> pairs) {
    overlaps(bvh_.nodes.data(), pairs, overlaps_.data());
    for (std::size_t i = 0; i < pairs.size(); ++i) {
      const bool self = pairs[i].a == pairs[i].b;
      chunk_.bv_tests() += !self;
      overlaps_[i] |= static_cast<std::uint8_t>(self);
    }
  }

  // Keeps a disjoint pair unless its parent is disjoint too. Then all pairs below the highest disjoint
  // ancestor are, and of those the one on the path of first children (the front holds exactly one such) puts
  // that ancestor in their place.
  void fold(NodePair pair) {
    bool folded = false;
    while (parent_disjoint(pair)) {
      if (!is_first_child(pair)) {
        ++chunk_.pruned();
        return;
      }
      pair = parent(pair);
      folded = true;
    }
    chunk_.pruned() += folded;
    chunk_.push(pair);
  }

  // Siblings are neighbours in the front, so the last answer often serves again.
  bool parent_disjoint(const NodePair& pair) {
    const NodePair above = parent(pair);
    if (above.a == above.b) return false;  // a node overlaps itself
    if (!(above == last_parent_)) {
      last_parent_ = above;
      ++chunk_.bv_tests();
      last_disjoint_ = !overlap(bvh_.nodes[above.a], bvh_.nodes[above.b]);
    }
    return last_disjoint_;
  }

  const Bvh<Bounds>& bvh_;
  LeafPairSink& sink_;
  ChunkOutputs::Chunk& chunk_;
  std::array<std::uint8_t, kPairs> overlaps_;
  NodePair last_parent_{0, 0};
  bool last_disjoint_ = false;
};

}  // namespace warmfront

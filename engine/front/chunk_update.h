// SPDX-License-Identifier: Apache-2.0
// Updating one chunk of the front. Used by one thread at a time.
// Source: Tang, Manocha, Tong 2009, section 4.3 (sprouting); pruning as in Ehmann, Lin 2001, made canonical.
#pragma once

#include "engine/front/chunks.h"
#include "engine/front/descend.h"

namespace warmfront {

template <class Bounds>
class ChunkUpdate {
 public:
  ChunkUpdate(const Bvh<Bounds>& bvh, LeafPairSink& sink, ChunkOutputs::Chunk& chunk, bool prune)
      : bvh_(bvh), sink_(sink), chunk_(chunk), prune_(prune) {}

  void update(const NodePair& pair) {
    const bool leaf = bvh_.shape.is_leaf(pair.a);
    if (pair.a == pair.b || overlap(pair)) {
      if (leaf) {
        chunk_.push(pair);
        sink_.leaf_pair(pair.a, pair.b);
      } else {
        ++chunk_.sprouted();
        descend(bvh_, pair, chunk_.bv_tests(), sink_, [this](const NodePair& end) { chunk_.push(end); });
      }
    } else if (prune_) {
      fold(pair);
    } else {
      chunk_.push(pair);
    }
  }

 private:
  bool overlap(const NodePair& pair) {
    ++chunk_.bv_tests();
    return warmfront::overlap(bvh_.nodes[pair.a], bvh_.nodes[pair.b]);
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
      last_disjoint_ = !overlap(above);
    }
    return last_disjoint_;
  }

  const Bvh<Bounds>& bvh_;
  LeafPairSink& sink_;
  ChunkOutputs::Chunk& chunk_;
  const bool prune_;
  NodePair last_parent_{0, 0};
  bool last_disjoint_ = false;
};

}  // namespace warmfront

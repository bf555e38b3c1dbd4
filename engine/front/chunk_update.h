// SPDX-License-Identifier: Apache-2.0
// Updating one chunk of the front. Used by one thread at a time.
// Source: Tang, Manocha, Tong 2009, section 4.3 (sprouting); pruning as in Ehmann, Lin 2001, made canonical.
#pragma once

#include <cstdint>

#include "engine/bounds/overlap.h"
#include "engine/front/descend.h"
#include "engine/front/front.h"

namespace warmfront {

template <class Bounds>
class ChunkUpdate {
 public:
  using Chunk = typename Front<Bounds>::Chunk;
  static constexpr std::size_t kPairs = 512;  ///< in a chunk, about

  /// `scratch` takes the chunk's new pairs where they change; it keeps its memory for the next chunk.
  ChunkUpdate(const Bvh<Bounds>& bvh, LeafPairSink& sink, FrontUpdate how, Chunk& scratch,
              typename Front<Bounds>::Counts& counts)
      : bvh_(bvh), sink_(sink), how_(how), scratch_(scratch), counts_(counts) {}

  /// Updates the pairs of a chunk, in order: overlapping ones are opened (leaf pairs handed over); with
  /// prune, disjoint ones are folded as far as their ancestors are disjoint, else kept. Returns whether the
  /// pairs changed and are in the scratch now; else they are where they were, with new budgets.
  bool run(Chunk& chunk) {
    for (std::size_t i = 0; i < chunk.size(); ++i) {
      FrontPair& pair = chunk[i];
      if (how_.lazy &&
          !pair.budget.spent(bvh_.travel[pair.nodes.a], bvh_.travel[pair.nodes.b], bvh_.travel_slack)) {
        ++counts_.skipped;
        how_.prune ? fold(chunk, i) : keep(chunk, i);
        continue;
      }
      const float gap = test(pair.nodes);
      if (gap > 0) {
        pair.budget = grant(pair.nodes, gap);
        how_.prune ? fold(chunk, i) : keep(chunk, i);
      } else if (bvh_.shape.is_leaf(pair.nodes.a)) {
        pair.budget = grant(pair.nodes, sink_.leaf_pair(pair.nodes.a, pair.nodes.b));
        keep(chunk, i);
      } else {
        ++counts_.sprouted;
        change(chunk, i);
        descend(bvh_, pair.nodes, counts_.bv_tests, sink_, [this](const NodePair& end, float end_gap) {
          scratch_.push_back({end, grant(end, end_gap)});
        });
      }
    }
    return changed_;
  }

 private:
  TravelBudget grant(const NodePair& pair, float gap) const { return grant_budget(bvh_, pair, gap); }

  // A node overlaps itself by definition (an empty leaf's bounds would say no).
  float test(const NodePair& pair) {
    if (pair.a == pair.b) return -1;
    ++counts_.bv_tests;
    return separation(bvh_.nodes[pair.a], bvh_.nodes[pair.b]);
  }

  // From here on the chunk's pairs go to the scratch, those before pair i first.
  void change(const Chunk& chunk, std::size_t i) {
    if (changed_) return;
    changed_ = true;
    scratch_.assign(chunk.begin(), chunk.begin() + static_cast<std::ptrdiff_t>(i));
  }

  void keep(const Chunk& chunk, std::size_t i) {
    if (changed_) scratch_.push_back(chunk[i]);
  }

  // Keeps a disjoint pair unless its parent is disjoint too. Then all pairs below the highest disjoint
  // ancestor are, and of those the one on the path of first children (the front holds exactly one such) puts
  // that ancestor in their place.
  void fold(const Chunk& chunk, std::size_t i) {
    NodePair pair = chunk[i].nodes;
    if (!(parent_gap(pair) > 0)) return keep(chunk, i);
    change(chunk, i);
    ++counts_.pruned;
    float gap = 0;
    while ((gap = parent_gap(pair)) > 0) {
      if (!is_first_child(pair)) return;
      pair = parent(pair);
      folded_gap_ = gap;
    }
    scratch_.push_back({pair, grant(pair, folded_gap_)});
  }

  // Siblings are neighbours in the front, so the last answer often serves again.
  float parent_gap(const NodePair& pair) {
    const NodePair above = parent(pair);
    if (above.a == above.b) return -1;  // a node overlaps itself
    if (!(above == last_parent_)) {
      last_parent_ = above;
      last_gap_ = test(above);
    }
    return last_gap_;
  }

  const Bvh<Bounds>& bvh_;
  LeafPairSink& sink_;
  const FrontUpdate how_;
  Chunk& scratch_;
  typename Front<Bounds>::Counts& counts_;
  bool changed_ = false;
  NodePair last_parent_{0, 0};
  float last_gap_ = -1;
  float folded_gap_ = -1;
};

}  // namespace warmfront

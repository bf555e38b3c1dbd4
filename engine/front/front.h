// SPDX-License-Identifier: Apache-2.0
// The front: where traversal of the bounding volume test tree ends, kept from step to step.
// Source: Tang, Manocha, Tong 2009, sections 4 and 5. Used by one thread at a time, inside Workers::run().
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "engine/front/chunks.h"
#include "engine/front/leaf_pairs.h"
#include "engine/front/node_pair.h"

namespace warmfront {

/// Holds, in depth-first order of the BVTT, the disjoint pairs at which traversal ended ({N, M} and {N, L} in
/// the paper) and all leaf pairs it reached ({L, L}, self pairs of leaves included). Depth-first order keeps
/// siblings and their hierarchy nodes together, so no sort is needed for locality, and makes a front built
/// from scratch and one that was updated comparable as sequences.
///
/// After build(), and after update() with prune, the front is canonical: a pair is in it exactly if it is the
/// first disjoint (or leaf) pair on its path from the root. So update(prune) == build() whatever the history.
template <class Bounds>
class Front {
 public:
  /// Traverses from the root, in parallel by cost-estimated tasks (section 5.2). With `record`, keeps the
  /// front; if it would exceed `max_bytes` it is dropped, overflowed() is true, and the leaf pairs have been
  /// handed over all the same.
  void build(const Bvh<Bounds>& bvh, LeafPairSinks& sinks, bool record, std::size_t max_bytes);

  /// Updates the front in parallel by chunks (section 5.3): pairs that overlap now are sprouted; with
  /// `prune`, disjoint pairs with a disjoint parent are folded into their highest disjoint ancestor. Requires
  /// a front of the same hierarchy.
  void update(const Bvh<Bounds>& bvh, LeafPairSinks& sinks, bool prune, std::size_t max_bytes);

  /// Forgets the front; memory is kept for the next one.
  void clear() { pairs_.clear(); }
  bool empty() const { return pairs_.empty(); }
  bool overflowed() const { return overflowed_; }
  std::span<const NodePair> pairs() const { return pairs_; }
  std::size_t memory_bytes() const;

  /// Of the last build() or update(). The same for any number of threads.
  struct Counts {
    std::uint64_t bv_tests = 0;
    std::uint64_t sprouted = 0;
    std::uint64_t pruned = 0;
  };
  const Counts& counts() const { return counts_; }

 private:
  // Pairs are held twice while an update is under way: in the front and in the chunks' output.
  static std::size_t max_pairs(std::size_t max_bytes) { return max_bytes / (2 * sizeof(NodePair)); }
  void gather();

  std::vector<NodePair> pairs_;
  ChunkOutputs outputs_;
  Counts counts_;
  bool overflowed_ = false;
};

}  // namespace warmfront

// SPDX-License-Identifier: Apache-2.0
// The front: where traversal of the bounding volume test tree ends, kept from step to step.
// Source: Tang, Manocha, Tong 2009, sections 4 and 5. Used by one thread at a time, inside Workers::run().
#pragma once

#include <tbb/enumerable_thread_specific.h>

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "engine/front/leaf_pairs.h"
#include "engine/front/node_pair.h"

namespace warmfront {

/// A pair of the front, and for how long it need not be looked at.
struct FrontPair {
  NodePair nodes;
  TravelBudget budget;
};

/// The budget of a pair whose nodes are `gap` apart; none where travel is not kept.
template <class Bounds>
TravelBudget grant_budget(const Bvh<Bounds>& bvh, const NodePair& pair, float gap) {
  return bvh.travel.empty() ? TravelBudget{}
                            : TravelBudget::grant(bvh.travel[pair.a], bvh.travel[pair.b], gap);
}

/// What an update does with the pairs.
struct FrontUpdate {
  bool prune = true;  ///< fold disjoint pairs with a disjoint parent into their highest disjoint ancestor
  bool lazy = false;  ///< do not look at pairs whose budget lasts
};

/// Holds, in depth-first order of the BVTT, the disjoint pairs at which traversal ended ({N, M} and {N, L} in
/// the paper) and all leaf pairs it reached ({L, L}, self pairs of leaves included). Depth-first order keeps
/// siblings and their hierarchy nodes together, so no sort is needed for locality, and makes a front built
/// from scratch and one that was updated comparable as sequences.
///
/// After build(), and after update() with prune, the front is canonical: a pair is in it exactly if it is the
/// first disjoint (or leaf) pair on its path from the root. So update(prune) == build() whatever the history.
///
/// The pairs lie in chunks, each in memory of its own: an update changes a chunk in place, and only chunks
/// whose pairs change are written anew.
template <class Bounds>
class Front {
 public:
  /// Traverses from the root, in parallel by cost-estimated tasks (section 5.2). With `record`, keeps the
  /// front; if it would exceed `max_bytes` it is dropped, overflowed() is true, and the leaf pairs have been
  /// handed over all the same.
  void build(const Bvh<Bounds>& bvh, LeafPairSinks& sinks, bool record, std::size_t max_bytes);

  /// Updates the front in parallel by chunks (section 5.3): pairs that overlap now are sprouted. Requires a
  /// front of the same hierarchy; with `lazy`, one whose travel was advanced in every step since it was
  /// built.
  void update(const Bvh<Bounds>& bvh, LeafPairSinks& sinks, FrontUpdate how, std::size_t max_bytes);

  /// Forgets the front.
  void clear();
  bool empty() const { return size_ == 0; }
  std::size_t size() const { return size_; }
  bool overflowed() const { return overflowed_; }
  /// All pairs in order; for tests.
  std::vector<NodePair> pairs() const;
  /// Bytes held: by the pairs, which is the same for any number of threads, and in all.
  std::size_t pair_bytes() const;
  std::size_t memory_bytes() const;

  /// Of the last build() or update(). The same for any number of threads.
  struct Counts {
    std::uint64_t bv_tests = 0;
    std::uint64_t skipped = 0;  ///< pairs not looked at
    std::uint64_t sprouted = 0;
    std::uint64_t pruned = 0;
  };
  const Counts& counts() const { return counts_; }

  using Chunk = std::vector<FrontPair>;

 private:
  // A thread's room for the chunk that it works on, and its counts.
  struct Scratch {
    Chunk pairs;
    Counts counts;
  };

  void begin(std::size_t max_bytes);
  void finish();
  // Puts `pairs` into `chunk`, unless all chunks together hold more than they may.
  void store(const Chunk& pairs, Chunk& chunk);
  void rebalance();

  std::vector<Chunk> chunks_;
  tbb::enumerable_thread_specific<Scratch> scratch_;
  std::atomic<std::size_t> recorded_{0};  // pairs in chunks so far
  std::size_t max_pairs_ = 0;
  std::size_t size_ = 0;
  Counts counts_;
  bool overflowed_ = false;
};

}  // namespace warmfront

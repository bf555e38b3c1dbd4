// SPDX-License-Identifier: Apache-2.0
// The front: where traversal of the bounding volume test trees ends, kept from step to step.
// Source: Tang, Manocha, Tong 2009, sections 4 and 5. Used by one thread at a time, but for test_subtree(),
// inside Workers::run().
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "engine/broad_phase/part_widths.h"
#include "engine/front/actions.h"
#include "engine/front/front_room.h"
#include "engine/front/leaf_pairs.h"
#include "engine/front/neighbours.h"
#include "engine/front/segment.h"
#include "engine/stop.h"

namespace warmfront {

/// What an update does with the pairs.
struct FrontUpdate {
  bool prune = true;   ///< fold disjoint pairs with a disjoint parent into their highest disjoint ancestor
  bool lazy = false;   ///< do not look at pairs whose budget lasts
  bool record = true;  ///< keep the front
  Answers answers = Answers::kReuse;  ///< what becomes of those of stationary leaf pairs
  PartWidths widths = {};             ///< within which bounds count as overlapping
  /// Pairs are folded where an ancestor is farther apart than this: no less than `widths`.
  PartWidths fold_widths = {};
  bool wider = false;  ///< `widths` are more than those of the update before
  /// Of the neighbours listed, those within subtrees that changed in this step were tested already, by
  /// test_subtree().
  bool subtrees_tested = false;
  GapAt gap_at = GapAt::kEnd;  ///< where budgets are granted
  std::size_t max_bytes = ~std::size_t{0};
  StopSignal stop = {};
};

/// Of the last advance(). The same for any number of threads.
struct FrontCounts {
  std::uint64_t bv_tests = 0;
  std::uint64_t skipped = 0;  ///< pairs not looked at, because they are still apart
  std::uint64_t rested = 0;   ///< pairs not looked at, because neither node changed
  std::uint64_t sprouted = 0;
  std::uint64_t pruned = 0;
  std::size_t bytes = 0;  ///< pair_bytes() after it

  void add(const FrontCounts& more) {
    bv_tests += more.bv_tests;
    skipped += more.skipped;
    rested += more.rested;
    sprouted += more.sprouted;
    pruned += more.pruned;
  }
};

/// Holds, a segment for each pair of parts that are near each other and in depth-first order of its BVTT, the
/// disjoint pairs at which traversal ended ({N, M} and {N, L} in the paper) and all leaf pairs it reached
/// ({L, L}, self pairs of leaves included). Depth-first order keeps siblings and their hierarchy nodes
/// together, so no sort is needed for locality, and makes a front built from scratch and one that was updated
/// comparable as sequences.
///
/// After an advance() with prune and without lazy the front is canonical: a pair is in it exactly if it is
/// the first disjoint (or leaf) pair on its path from the root. So update == build, whatever the history.
///
/// Beside the front, where it is lazy, the neighbouring blocks of a part are listed at the first update of
/// its segment with itself: each two of them have a budget of their own (neighbours.h), and its leaf pairs do
/// not hand them over any more.
///
/// The pairs lie in chunks, each in memory of its own: an update changes a chunk in place, and only chunks
/// whose pairs change are written anew.
template <class Bounds>
class Front {
 public:
  Front();
  ~Front();

  /// Goes to this step: segments of pairs in `near` (sorted, no pair twice) are updated, or built where there
  /// are none yet; all others are dropped. In parallel, by cost-estimated tasks (section 5.2) where building,
  /// by chunks (section 5.3) where updating. `trees` are by part; with `lazy`, their travel was advanced in
  /// every step since a segment was built. Pairs, neighbours and answers kept of what is stationary hold no
  /// more than `max_bytes`: where the answers are too many, stationary leaf pairs are tested in every step
  /// instead; where the pairs are, the front is dropped and overflowed() is true. The leaf pairs have been
  /// handed over all the same. Throws Stopped, and is good for clear() only then, when told to stop.
  void advance(std::span<const Bvh<Bounds>> trees, std::span<const NearPair> near, LeafPairSinks& sinks,
               const FrontUpdate& how);

  /// Begins a step, before any test_subtree(). A front whose answers had no room is dropped after some steps:
  /// there may be room by now.
  void begin_step();
  /// Tests the neighbours of a part, where they are listed, that lie within one subtree of its hierarchy. The
  /// subtree changed and has just been refit, so that its blocks are still in cache. advance() of the same
  /// step must know (FrontUpdate::subtrees_tested), with the part in `near` against itself. Thread-safe for
  /// different subtrees.
  void test_subtree(PartId part, std::uint32_t subtree, LeafPairSink& sink);

  /// The next motion begins where everything stands now, as far as `trees` have travelled, and questions
  /// about it have these widths at most: budgets that do not last for that here are spent for good, wherever
  /// the motion leads, since a budget tells of where motions begin only that it lasted there. O(pairs).
  void settle(std::span<const Bvh<Bounds>> trees, const PartWidths& widths) noexcept;

  /// Motions begin elsewhere than at the end of the last trial, for which budgets were granted there: those
  /// are charged for the way back from there. kForBase: those that do not last for `widths` at the base then
  /// are spent; kForPartWay: settle() must follow, once `trees` have travelled that part only. `off_base`, by
  /// part: the trial added to its travel. O(pairs).
  void leave_trial(std::span<const Bvh<Bounds>> trees, std::span<const std::uint8_t> off_base, TrialLeft left,
                   const PartWidths& widths) noexcept;

  /// Forgets the front.
  void clear();
  /// Forgets what has to do with a part whose hierarchy is another one now.
  void forget(PartId part);
  /// The same of all parts that are marked, by part. O(segments).
  void forget(std::span<const std::uint8_t> marked) noexcept;
  /// A part's hierarchy has changed in these blocks alone (Bvh::change()), by block: what it says of all
  /// others stays; budgets of what holds one are spent. `trees` have travelled as far as where motions begin.
  /// O(pairs). Throws Stopped, and is good for clear() only then, when told to stop.
  void follow(PartId part, std::span<const Bvh<Bounds>> trees, std::span<const std::uint8_t> changed_blocks,
              std::size_t max_bytes, StopSignal stop);

  bool empty() const { return size_ == 0; }
  std::size_t size() const { return size_; }
  bool overflowed() const { return overflowed_; }
  /// For a self-check.
  std::span<const FrontSegment> segments() const { return segments_; }
  const Neighbours& neighbours() const { return neighbours_; }
  /// All pairs in order; for tests.
  std::vector<NodePair> pairs() const;
  /// Bytes held: by the pairs, which is the same for any number of threads, and in all.
  std::size_t pair_bytes() const;
  std::size_t memory_bytes() const;

  const FrontCounts& counts() const { return counts_; }
  /// Segments of the last advance() that were there before.
  std::size_t updated_segments() const { return updated_; }

  /// About what a segment of one pair takes, with what a step needs for it meanwhile.
  static constexpr std::size_t kSegmentBytes =
      sizeof(FrontSegment) + sizeof(FrontChunk) + sizeof(FrontPair) + 2 * sizeof(NearPair) + 80;

 private:
  struct Impl;
  struct Work;

  // Brings `segments_` into line with `near`; what is new has no chunks.
  void match(std::span<const NearPair> near, StopSignal stop);
  // What the tasks of the step are.
  void plan(std::span<const Bvh<Bounds>> trees, std::span<const NearPair> near, const FrontUpdate& how);
  bool list_neighbours(PartId part, const Bvh<Bounds>& tree, const FrontUpdate& how);
  void run(const Work& work, std::span<const Bvh<Bounds>> trees, LeafPairSinks& sinks,
           const FrontUpdate& how);
  void update(const Work& work, const TreePair<Bounds>& trees, LeafPairSinks& sinks, const FrontUpdate& how);
  void reuse(const FrontChunk& chunk, LeafPairSink& sink, StopSignal stop);
  void run_neighbours(const Bvh<Bounds>& tree, PartId part, NeighbourChunk& chunk, LeafPairSink& sink,
                      bool wider, Answers answers);
  void forget(FrontSegment& segment);
  // Puts the scratch's pairs into `chunk`, unless all chunks together hold more than they may.
  void store(FrontChunk& chunk);
  void drop_answers();

  std::vector<FrontSegment> segments_;  // sorted by parts
  Neighbours neighbours_;               // of parts that have a segment with themselves
  std::unique_ptr<Impl> impl_;
  FrontRoom room_{sizeof(FrontPair)};
  std::size_t size_ = 0;
  std::size_t updated_ = 0;
  FrontCounts counts_;
  bool overflowed_ = false;
  bool keeps_answers_ = true;  // or there was no room for them
  std::size_t steps_without_them_ = 0;
};

}  // namespace warmfront

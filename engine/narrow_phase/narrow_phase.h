// SPDX-License-Identifier: Apache-2.0
// From leaf pairs to contacts: triangle pairs, the feature pairs they own, and the elementary cascade, block
// by block. One NarrowPhase serves all threads of a step; each thread uses its own sink.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "engine/broad_phase/part_widths.h"
#include "engine/contact.h"
#include "engine/elementary/keep_distance.h"
#include "engine/front/leaf_pairs.h"
#include "engine/motion/arcs.h"
#include "engine/motion/commit_room.h"
#include "engine/motion/motion.h"
#include "engine/narrow_phase/orphan_blocks.h"
#include "engine/options.h"
#include "engine/parallel/stage_clock.h"
#include "engine/parallel/unwritten_list.h"
#include "engine/scene/orphans.h"
#include "engine/scene/ownership.h"
#include "engine/scene/pair_filter.h"
#include "engine/scene/patches.h"
#include "engine/scene/renumbering.h"
#include "engine/scene/thickness.h"
#include "engine/scene/worlds.h"
#include "engine/statistics.h"
#include "engine/stop.h"

namespace warmfront {

/// Input of a step's narrow phase. Constant from begin() on, except a part's vertex bounds and hierarchy:
/// these are constant once computed for the step, and the part is not tested before.
struct NarrowPhaseInput {
  const Scene& scene;
  const Renumbering& numbering;  ///< contacts are reported in given numbers
  const Ownership& ownership;
  const PairFilter& filter;
  const Thickness& thickness;
  const Arcs& arcs;
  const Worlds& worlds;
  const Patches& patches;
  std::span<const std::uint8_t> patch_culled;  ///< by patch: cannot meet itself in this step
  std::span<const VertexMotion> vertices;
  std::span<const MotionState> states;  ///< of the vertices
  std::span<const PointBounds> vertex_bounds;
  const ColliderOptions& options;
  StopSignal stop;
  GapAt gap_at = GapAt::kEnd;  ///< see FrontUpdate
  /// A trial, of which others may go part of the way: what it meets is noted for test_met().
  bool note_met = false;
  /// Where its share is not 0, or there is `room`, each pair has a separation of its own, for which
  /// options.min_separation, with the thickness of both, is none too small; keep.beyond is what is asked of
  /// all.
  KeepDistance keep = {};
  /// Where keep.share is not 0: keep.beyond, or more, with all the room that any pair has.
  double kept_beyond = 0;
  PartWidths widths = {};  ///< of options.min_separation: what bounds must be apart by
  /// Of Report::kVertexDistances, by given vertex: the distance asked about, and then less where something is
  /// nearer. Written by all threads, each number atomically.
  std::span<double> vertex_distances = {};
  bool half_spaces = false;  ///< are there any?
  /// Where it is asked for, how near pairs may come goes by it: WithRoom.
  const CommitRoom* room = nullptr;
  /// Of Report::kEarliest, by place of a world: later contacts are not needed; empty where all are.
  std::span<const double> until = {};

  /// Pairs and kept contacts that are noted, by each thread and in all; where there are more, test_met() does
  /// not serve.
  static constexpr std::size_t kMostMet = std::size_t{1} << 18;
};

class PairTester;

/// Thrown when more contacts are found than options.max_contacts allows: the step is refused at once.
struct TooManyContacts {};

/// A step's answer and its cost.
struct NarrowPhaseOutput {
  KindCounts found;
  std::uint64_t possible = 0;
  std::uint64_t overlaps = 0;  ///< at the start, that no contact tells: see StepResult::overlaps_at_start
  double earliest = 2;         ///< least toi; 2 without contacts
  StepCounts counts;           ///< only the narrow phase's counts
  bool over_limit = false;     ///< Report::kEarliest: more ties than options.max_contacts

  void add(const NarrowPhaseOutput& more);
};

template <class Bounds>
class NarrowPhase final : public LeafPairSinks {
 public:
  NarrowPhase();
  ~NarrowPhase() override;

  /// Clears the last step's answer. `trees`, by part, and `input` must outlive the step.
  void begin(std::span<const Bvh<Bounds>> trees, const NarrowPhaseInput& input);

  LeafPairSink& local() override;
  StageClock& clock() override;
  /// This thread's, for pairs that come from no hierarchy.
  PairTester& tester();

  /// Has all been noted that the last question that did met, but for the orphan sets'?
  bool knows_met() const;
  /// Was any of that taken from questions before it? What met and gave no contact is not noted then.
  bool met_kept() const;
  /// Instead of a front: tests what was met then, for a motion that goes part of the same way. Parallel.
  void test_met();

  /// Tests the remaining pairs in the threads' blocks. Parallel.
  void flush();

  /// By the threads' clocks: their time since the last call, or begin(), summed.
  StageSeconds take_times();

  /// Of intersections: tests edges and faces that no pair of faces offers, edge_face_orphans() of a part.
  /// Parallel; flush() must follow.
  void test_edge_face_orphans(std::span<const EdgeFaceIds> orphans);
  /// Tests the orphan sets of parts, in parallel. With `retest`, also those whose vertices have not changed
  /// since their last test.
  void test_orphans(std::span<OrphanBlocks* const> parts, bool retest);

  /// Merges the threads' contacts, sorted, into `contacts` (left empty for Report::kCount). Parallel.
  NarrowPhaseOutput finish(UnwrittenList<Contact>& contacts);
  /// After finish(), of Report::kEarliest: the least toi in a world, by its place in Worlds;
  /// EarliestTimes::kNone without a contact.
  double earliest_in(std::uint32_t world) const;

  /// Frees the memory that a failed step allocated; call it before the next begin().
  void release() noexcept;

  std::size_t memory_bytes() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace warmfront

// SPDX-License-Identifier: Apache-2.0
// From leaf pairs to contacts: triangle pairs, the feature pairs they own, and the elementary cascade, block
// by block. One NarrowPhase serves all threads of a step; each thread works through its own sink.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "engine/contact.h"
#include "engine/front/leaf_pairs.h"
#include "engine/motion/motion.h"
#include "engine/narrow_phase/orphan_blocks.h"
#include "engine/options.h"
#include "engine/scene/orphans.h"
#include "engine/scene/ownership.h"
#include "engine/scene/patches.h"
#include "engine/scene/renumbering.h"
#include "engine/statistics.h"
#include "engine/stop.h"

namespace warmfront {

/// What a step's narrow phase reads. Constant from begin() on; the bounds of a part's vertices, and its
/// hierarchy, from when they were made for the step: nothing of the part is tested before.
struct NarrowPhaseInput {
  const Scene& scene;
  const Renumbering& numbering;  ///< contacts are reported in original numbers
  const Ownership& ownership;
  const Patches& patches;
  std::span<const std::uint8_t> patch_culled;  ///< by patch: cannot meet itself in this step
  std::span<const VertexMotion> vertices;
  std::span<const MotionState> states;  ///< of the vertices
  std::span<const PointBounds> vertex_bounds;
  const ColliderOptions& options;
  StopSignal stop;
  GapAt gap_at = GapAt::kEnd;  ///< see FrontUpdate
};

/// Thrown where more contacts are found than options.max_contacts allows to list: the step is refused at
/// once.
struct TooManyContacts {};

/// A step's answer and what it cost.
struct NarrowPhaseOutput {
  std::uint64_t vf = 0;
  std::uint64_t ee = 0;
  std::uint64_t possible = 0;
  std::uint64_t overlaps = 0;     ///< that options.leave_out_overlaps leaves out
  double earliest = 2;            ///< least toi; 2 without contacts
  double elementary_seconds = 0;  ///< that all threads spent in the cascade
  StepCounts counts;              ///< only what the narrow phase counts
  bool over_limit = false;        ///< of Report::kEarliest, more ties than options.max_contacts

  void add(const NarrowPhaseOutput& more);
};

template <class Bounds>
class NarrowPhase final : public LeafPairSinks {
 public:
  NarrowPhase();
  ~NarrowPhase() override;

  /// Forgets the last step's answer. `trees`, by part, and `input` must outlive the step.
  void begin(std::span<const Bvh<Bounds>> trees, const NarrowPhaseInput& input);

  LeafPairSink& local() override;

  /// Tests what is left in the threads' blocks. Parallel.
  void flush();

  /// Seconds that all threads have spent in the cascade so far in this step.
  double elementary_seconds() const;

  /// Tests the orphan sets of parts, in parallel. Where `retest`, also those whose vertices have not changed
  /// since they were tested last.
  void test_orphans(std::span<OrphanBlocks* const> parts, bool retest);

  /// Puts the threads' contacts together, sorted, into `contacts` (left empty for Report::kCount). Parallel.
  NarrowPhaseOutput finish(std::vector<Contact>& contacts);

  /// Gives back what a step that failed has grown: before the next begin().
  void release() noexcept;

  std::size_t memory_bytes() const;

 private:
  class Sink;
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace warmfront

// SPDX-License-Identifier: Apache-2.0
// The stage that tests the orphan sets: the feature pairs of adjacent triangles that no other pair offers.
// Used by one thread at a time, inside Workers::run().
#pragma once

#include <cstddef>
#include <vector>

#include "engine/narrow_phase/narrow_phase.h"
#include "engine/scene/held_bytes.h"
#include "engine/state/core.h"

namespace warmfront {

class OrphanStage {
 public:
  /// Tests those of all parts that are tested against themselves, in parallel; of intersections, where an
  /// edge and a face are the pair, those that are found around each edge. `retest`: also those whose vertices
  /// have not changed since their last test. Throws what narrow.test_orphans() throws.
  template <class Bounds>
  void run(Core& core, NarrowPhase<Bounds>& narrow, bool retest) {
    if (core.options.pair_test == PairTest::kIntersection) {
      take_edges(core);
      narrow.test_adjacent_edge_faces(edges_);
    } else {
      take_parts(core);
      narrow.test_orphans(parts_, retest);
    }
  }

  /// What was found of unchanged vertices does not hold.
  static void forget_answers(Core& core) noexcept;

  std::size_t memory_bytes() const { return held_bytes(parts_, edges_); }

 private:
  void take_parts(Core& core);
  void take_edges(const Core& core);

  std::vector<OrphanBlocks*> parts_;
  std::vector<FeatureRange> edges_;  // of parts whose edges are tested against faces
};

}  // namespace warmfront

// SPDX-License-Identifier: Apache-2.0
// The stage that tests the orphan sets: the feature pairs of adjacent triangles that no other pair offers.
// Used by one thread at a time, inside Workers::run().
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "engine/narrow_phase/narrow_phase.h"
#include "engine/scene/held_bytes.h"
#include "engine/scene/orphans.h"
#include "engine/state/core.h"

namespace warmfront {

class OrphanStage {
 public:
  /// Tests those of all parts that are tested against themselves, in parallel; of intersections, where an
  /// edge and a face are the pair, those of edges and faces, which the first such question enumerates.
  /// `retest`: also those whose vertices have not changed since their last test. Throws what
  /// narrow.test_orphans() throws.
  template <class Bounds>
  void run(Core& core, NarrowPhase<Bounds>& narrow, bool retest, StopSignal stop) {
    if (core.options.pair_test == PairTest::kIntersection) {
      for (const PartId part : take_edge_faces(core, stop))
        narrow.test_edge_face_orphans(edge_faces_[number_of(part)].orphans);
      narrow.flush();
    } else {
      take_parts(core);
      narrow.test_orphans(parts_, retest);
    }
  }

  /// What was found of unchanged vertices does not hold.
  static void forget_answers(Core& core) noexcept;

  /// Parts were added or changed.
  void forget_edge_faces() noexcept { edge_faces_.clear(); }

  std::size_t memory_bytes() const;

 private:
  void take_parts(Core& core);
  // The parts that are tested against themselves, whose edge-face orphans are known then; valid until the
  // next call.
  std::span<const PartId> take_edge_faces(const Core& core, StopSignal stop);

  struct EdgeFaces {
    bool known = false;
    std::vector<EdgeFaceIds> orphans;
  };
  std::vector<OrphanBlocks*> parts_;
  std::vector<EdgeFaces> edge_faces_;   // by part
  std::vector<PartId> testing_;         // as take_edge_faces() returned
};

}  // namespace warmfront

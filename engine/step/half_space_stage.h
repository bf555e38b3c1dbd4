// SPDX-License-Identifier: Apache-2.0
// The stage that tests half-spaces against vertices, each vertex once. It keeps nothing from step to step:
// what it finds follows from the motion in hand alone, so that nothing that steps, trials and commits keep
// concerns it. Used by one thread at a time, inside Workers::run().
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "engine/elementary/half_space.h"
#include "engine/narrow_phase/narrow_phase.h"
#include "engine/state/core.h"
#include "engine/stop.h"

namespace warmfront {

/// A body that is a half-space, in the motion in hand.
HalfSpaceMotion half_space_now(const Core& core, std::uint32_t body);
/// A vertex in new numbers, in the motion in hand, placed or not.
VertexMotion vertex_now(const Core& core, std::uint32_t v);

class HalfSpaceStage {
 public:
  /// Tests all vertices of bodies that the half-spaces may meet, and tells `narrow`. `roots`: by part, bounds
  /// of it in this motion, or none. Throws Stopped when told to stop, and TooManyContacts.
  template <class Bounds>
  void run(const Core& core, std::span<const Bounds> roots, NarrowPhase<Bounds>& narrow, StopSignal stop);

  std::size_t memory_bytes() const;

 private:
  /// Vertices [first, end) of a part.
  struct Task {
    PartId part;
    std::uint32_t first;
    std::uint32_t end;
  };

  // Of one half-space.
  template <class Bounds>
  void find_tasks(const Core& core, const CollisionModel::HalfSpaceOf& half_space,
                  const HalfSpaceMotion& motion, std::span<const Bounds> roots, StopSignal stop);

  std::vector<Task> tasks_;
};

}  // namespace warmfront

// SPDX-License-Identifier: Apache-2.0
// The stage that refits hierarchies and tests neighbours: each subtree is refit by a task, which then tests
// the neighbours listed within it (front/neighbours.h), while its blocks are still in cache. Used by one
// thread at a time, inside Workers::run().
#pragma once

#include <cstdint>
#include <span>

#include "engine/front/front.h"
#include "engine/narrow_phase/narrow_phase.h"
#include "engine/state/part_trees.h"

namespace warmfront {

/// Of one step. Throws Stopped when told to stop.
template <class Bounds>
class RefitStage {
 public:
  RefitStage(Core& core, PartTrees<Bounds>& trees, Front<Bounds>& front, NarrowPhase<Bounds>& narrow,
             StopSignal stop)
      : core_(core), trees_(trees), front_(front), narrow_(narrow), stop_(stop) {}

  /// Refits all parts but those that wait until something comes near: see PartTrees::wait().
  void refit_placed(ApartParts* apart, bool rebuild);
  /// Refits those of `near` that waited.
  void refit_near(std::span<const NearPair> near);

 private:
  void refit(PartId part);

  Core& core_;
  PartTrees<Bounds>& trees_;
  Front<Bounds>& front_;
  NarrowPhase<Bounds>& narrow_;
  StopSignal stop_;
};

}  // namespace warmfront

// SPDX-License-Identifier: Apache-2.0
// Whether what a collider keeps from step to step is still what it must be: for memory that fails, and for
// code that is wrong. Reads between steps, in parallel inside Workers::run(); changes nothing.
#pragma once

#include <cstdint>
#include <span>

#include "engine/broad_phase/apart_parts.h"
#include "engine/front/front.h"
#include "engine/result.h"
#include "engine/state/core.h"
#include "engine/stop.h"

namespace warmfront {

/// What a pipeline keeps, after a step that was completed.
template <class Bounds>
struct KeptState {
  const Core& core;
  std::span<const Bvh<Bounds>> trees;  ///< by part
  std::span<const Bounds> roots;       ///< by part
  std::span<const std::int64_t>
      refit_in;  ///< by part: the step that its hierarchy is of; not this, when not needed
  std::int64_t step;
  std::span<const NearPair> near;
  std::span<const ApartPair> apart;  ///< near ones that are left out
  const Front<Bounds>* front;        ///< null where none is kept
  double magnitude;                  ///< that bounds were made with
  std::uint64_t turn;                ///< of checks: what is sampled goes on from turn to turn
  StopSignal stop = {};
};

/// Of everything that must not change between steps: the scene in both numberings, the order of each part's
/// primitives, and the orphan sets that are in use. O(scene). Throws Stopped when told to stop. It is the sum
/// of topology_checksum() and each part's orphans_checksum(), modulo 2^64, so that a change of one part need
/// not go through the others.
std::uint64_t checksum(const Core& core, StopSignal stop = {});

/// Fails with kDataLoss when what cannot be made anew is broken: the checksum, or positions outside of their
/// bounds, of which either may be wrong. Fails with kInternal when what is kept for speed is: a hierarchy
/// that does not hold its primitives once each or whose bounds do not hold them, parts that are near and not
/// looked at, parts that are taken for apart and are not, a front that is no cut through its test tree, in
/// depth-first order, or that holds pairs as disjoint which are not, neighbouring blocks that are not
/// listed or are taken for apart, and counts that do not add up. The message says what and where. Checks all
/// but the nearness of parts, of which about a million pairs are looked at in a turn, and neighbours'
/// budgets, of which a part is. About as dear as a refit and two looks at each pair of the front.
/// Throws Stopped when told to stop.
template <class Bounds>
Status self_check(const KeptState<Bounds>& kept);

}  // namespace warmfront

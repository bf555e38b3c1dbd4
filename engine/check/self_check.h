// SPDX-License-Identifier: Apache-2.0
// Checks whether the data that a collider caches between steps are still valid: detects faulty memory and
// wrong code. Reads between steps, in parallel inside Workers::run(); changes nothing.
#pragma once

#include <cstdint>
#include <span>

#include "engine/broad_phase/apart_parts.h"
#include "engine/front/front.h"
#include "engine/result.h"
#include "engine/state/core.h"
#include "engine/stop.h"

namespace warmfront {

/// A pipeline's cached data after a completed step.
template <class Bounds>
struct KeptState {
  const Core& core;
  std::span<const Bvh<Bounds>> trees;  ///< by part
  std::span<const Bounds> roots;       ///< by part
  std::span<const std::int64_t>
      refit_in;  ///< by part: the step of its last refit; older if it was not needed in this step
  std::int64_t step;
  std::span<const NearPair> near;
  std::span<const NearPair> turning;  ///< those that are tested without a front
  std::span<const ApartPair> apart;  ///< near pairs that are excluded
  const Front<Bounds>* front;        ///< null without a front
  double magnitude;                  ///< that the bounds were computed with
  PartWidths widths;                 ///< of the last question
  std::uint64_t turn;                ///< of checks: sampling continues from turn to turn
  StopSignal stop = {};
};

/// Of all data that must not change between steps: the scene in both numberings, the order of each part's
/// primitives, and the orphan sets in use. O(scene). Throws Stopped when told to stop. The sum of
/// topology_checksum() and each part's orphans_checksum(), modulo 2^64, so that a change of one part needs no
/// pass over the others.
std::uint64_t checksum(const Core& core, StopSignal stop = {});

/// Fails with kDataLoss when data that cannot be recomputed are broken: the checksum, that of the filters, or
/// positions outside of their bounds (either may be wrong). Fails with kInternal when cached data are: a
/// hierarchy that does not contain each primitive once, whose bounds do not contain them, or whose nodes
/// count as in another patch; near parts that are not tested; parts wrongly marked as apart; a front that is
/// no cut through its test tree in depth-first order, or marks overlapping pairs as disjoint; neighbouring
/// blocks that are missing or wrongly marked as apart; counts that do not add up. The message says what and
/// where. Checks all of that except the nearness of parts, about a million pairs a turn, and neighbours'
/// budgets, a fraction a turn; of parts whose hierarchy the last step did not need nothing but the checksums,
/// and of reference shapes, half-spaces and options nothing. Costs about a refit and two visits of each pair
/// of the front. Throws Stopped when told to stop.
template <class Bounds>
Status self_check(const KeptState<Bounds>& kept);

}  // namespace warmfront

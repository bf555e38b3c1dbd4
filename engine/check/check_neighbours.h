// SPDX-License-Identifier: Apache-2.0
// Checks a front's cached budgets of a part's neighbouring blocks: a part of the self-check (self_check.h).
#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "engine/bounds/point_bounds.h"
#include "engine/bvh/bvh.h"
#include "engine/front/neighbours.h"
#include "engine/scene.h"
#include "engine/stop.h"

namespace warmfront {

/// The first fault, or an empty string: `kept` must list the neighbours of `tree`, and those with budget left
/// must be apart by more than `width` at the end of the step. Checks the budgets of one chunk in kBudgetTurns, rotating with
/// `turn`. Parallel. Throws Stopped when told to stop.
template <class Bounds>
std::string broken_neighbours(std::span<const NeighbourChunk> kept, const Bvh<Bounds>& tree,
                              const Scene& scene, std::span<const PointBounds> vertex_bounds,
                              const Width& width, std::uint64_t turn, StopSignal stop = {});
inline constexpr std::uint64_t kBudgetTurns = 16;

}  // namespace warmfront

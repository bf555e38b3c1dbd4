// SPDX-License-Identifier: Apache-2.0
// The stage that finds the patches that cannot meet themselves in a step, by normal cones and contours. Pure
// function of the step's motion.
#pragma once

#include <cstdint>

#include "engine/state/core.h"
#include "engine/stop.h"

namespace warmfront {

/// Writes core.patch_culled, for patches of parts that are tested against themselves, whose vertices are
/// where the step takes them. Returns how many are culled. Parallel, inside Workers::run(). Throws Stopped
/// when told to stop.
std::uint64_t cull_patches(Core& core, StopSignal stop);

}  // namespace warmfront

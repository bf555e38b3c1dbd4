// SPDX-License-Identifier: Apache-2.0
// Whether two features are too near each other at rest to count. Pure function.
#pragma once

#include <cstdint>

#include "engine/narrow_phase/feature_block.h"
#include "engine/scene.h"
#include "engine/scene/pair_filter.h"

namespace warmfront {

/// Are the features of this pair at most filter.rest_distance() > 0 apart at rest, in real arithmetic on the
/// given doubles?
bool is_near_at_rest(const PairFilter& filter, const Scene& scene, const FeaturePair& pair);

}  // namespace warmfront

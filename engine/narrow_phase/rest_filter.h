// SPDX-License-Identifier: Apache-2.0
// Whether two features are too near each other at rest to count. Pure functions.
#pragma once

#include <cstddef>

#include "engine/narrow_phase/feature_block.h"
#include "engine/scene.h"
#include "engine/scene/pair_filter.h"

namespace warmfront {

/// Removes the pairs, vertex-face and edge-edge, whose features are at most filter.rest_distance() > 0 apart
/// at rest, in real arithmetic on the given doubles; the others stay in order. Returns how many were removed.
std::size_t drop_near_at_rest(const PairFilter& filter, FeatureBlock& block);

/// The same of an edge and a face.
bool is_near_at_rest(const PairFilter& filter, const Scene& scene, const FeaturePair& pair);

}  // namespace warmfront

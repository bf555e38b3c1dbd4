// SPDX-License-Identifier: Apache-2.0
// Proximity of two features in any tier.
#pragma once

#include "engine/elementary/proximity.h"

namespace warmfront::testing {

inline Verdict proximity(const FeatureVertices& features, Instant at, Tier tier, double distance) {
  ElementaryCounts counts;
  return proximity_test(features, at, {.tier = tier, .min_separation = distance}, counts);
}

}  // namespace warmfront::testing

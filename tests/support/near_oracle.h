// SPDX-License-Identifier: Apache-2.0
// The true answer to an elementary query with a separation, computed independently of the engine's tiers:
// whether, and when first, the primitives are no farther apart than that, from the distances between all
// their sub-features, compared at algebraic times in integers of any length. Slow (milliseconds) and without
// tolerance. Pure functions, no shared state.
#pragma once

#include "tests/support/exact_oracle.h"

namespace warmfront::testing {

/// Is the distance between the closed convex hulls of the primitives <= `separation` (finite, >= 0; used
/// exactly) at some t in [0, 1] of the linear motion, and when first? For any finite coordinates, degenerate
/// primitives included. With a separation of 0 it is exact_truth(), found in another way.
ExactTruth near_truth(const FeatureVertices& features, double separation);

}  // namespace warmfront::testing

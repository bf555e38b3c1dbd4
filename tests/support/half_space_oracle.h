// SPDX-License-Identifier: Apache-2.0
// The true answer of a vertex and a half-space, computed independently of the engine's tiers: whether, and
// when first, n(t) . (x(t) - p(t)) <= s |n(t)|, decided at every algebraic time at which that can begin, in
// integers of any length. Slow and without tolerance. Pure functions, no shared state.
#pragma once

#include "engine/elementary/half_space.h"
#include "tests/support/exact_oracle.h"

namespace warmfront::testing {

ExactTruth half_space_truth(const VertexMotion& vertex, const HalfSpaceMotion& half_space, double separation);

}  // namespace warmfront::testing

// SPDX-License-Identifier: Apache-2.0
// Distance between the primitives of a query at a time, relative to the query's size, in long double: an
// upper bound up to rounding, to check how much a conservative answer overstates. Pure functions.
#pragma once

#include "engine/elementary/query.h"

namespace warmfront::testing {

/// Distance at `t` divided by the largest coordinate difference between the two primitives' vertices at t = 0
/// and 1; 0 when all of these vanish.
long double relative_distance(const FeatureVertices& features, double t);

}  // namespace warmfront::testing

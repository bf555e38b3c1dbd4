// SPDX-License-Identifier: Apache-2.0
// The elementary test of proximity: are two primitives within a distance of each other at one instant? A pure
// function, safe to call from any thread in the default floating-point environment (Workers checks it).
#pragma once

#include "engine/elementary/elementary_test.h"
#include "engine/elementary/query.h"
#include "engine/elementary/verdict.h"
#include "engine/options.h"

namespace warmfront {

/// Is the distance between the primitives, as they stand at `at`, no more than options.min_separation (>= 0)?
/// A pair that is has status kHit where that is proved, else kPossible; toi is 0 at the start, 1 at the end.
///   - Tier certified misses none, and reports none beyond min_separation + 2^-19 of the pair's size (the
///     largest coordinate difference between vertices of the two primitives);
///   - tier exact decides in real arithmetic on the given doubles: only kHit.
/// Degenerate primitives included. Proof: README.md, "Proximity".
Verdict proximity_test(const FeatureVertices& features, Instant at, const ElementaryOptions& options,
                       ElementaryCounts& counts);

/// A lower bound of the distance between the primitives as they stand at `at`, in the scene's unit; at most
/// `most` (>= 0) and at least 0. Short of the distance by less than 2^-19 of the pair's size, and by some 2^-46 of
/// it where doubles find the direction between the closest points. Degenerate primitives included. Proof:
/// README.md, "Proximity".
double least_distance(const FeatureVertices& features, Instant at, double most);

}  // namespace warmfront

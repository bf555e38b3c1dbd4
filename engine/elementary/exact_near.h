// SPDX-License-Identifier: Apache-2.0
// The exact tier with a separation: an elementary test without false positives or negatives. A pure function
// except for the count, safe to call from any thread in the default floating-point environment (Workers
// checks it).
#pragma once

#include <cstdint>

#include "engine/elementary/query.h"
#include "engine/elementary/verdict.h"

namespace warmfront {

/// Is the distance between the closed convex hulls of the primitives at most `separation` at some t in [0,
/// `latest`] of the linear motion, in real arithmetic on the given doubles, and when first? For any finite
/// coordinates, degenerate primitives included, and a finite separation above 0:
///   - toi is the largest double not above the first such time;
///   - status is kHit, or kOverlapAtStart when toi is 0.
///
/// A cascade as exact_test(): the certified test with this separation, which never misses, and what is
/// certainly nearer at the start or soon after its time; exact integers on the stack where coordinates and
/// separation span at most 124 bits and one root is certain; GMP for the remaining pairs, counted in
/// `exact_tests`. Derivation: README.md, "Exact with a separation". Only GMP's part allocates.
Verdict exact_near_test(const FeatureVertices& features, double separation, double latest,
                        std::uint64_t& exact_tests);

}  // namespace warmfront

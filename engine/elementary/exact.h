// SPDX-License-Identifier: Apache-2.0
// The exact tier: an elementary test without false positives or negatives. A pure function except for the
// count, safe to call from any thread in the default floating-point environment (Workers checks it).
#pragma once

#include <cstdint>

#include "engine/elementary/query.h"
#include "engine/elementary/verdict.h"

namespace warmfront {

/// Do the closed convex hulls of the primitives meet at some t in [0, `latest`] of the linear motion, in real
/// arithmetic on the given doubles, and when first? For any finite coordinates, degenerate primitives
/// included:
///   - toi is the largest double not above the first time of contact;
///   - status is kHit, or kOverlapAtStart when toi is 0: contact at t = 0, or before the least positive
///   double.
///
/// A cascade in which each stage answers only if certain: signs of the coplanarity cubic and inside tests in
/// double; exact integers on the stack where each axis's coordinates span at most 124 bits; GMP for the
/// remaining pairs, counted in `exact_tests`. Only GMP allocates. Time is bounded, since integers have at
/// most about 2100 bits an axis and roots are separated by doubling the precision: below 1 ms in all property
/// tests, except about 20 ms where each coordinate has its own exponent between -1074 and 1023.
Verdict exact_test(const FeatureVertices& features, double latest, std::uint64_t& exact_tests);

}  // namespace warmfront

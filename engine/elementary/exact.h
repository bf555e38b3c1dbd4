// SPDX-License-Identifier: Apache-2.0
// The exact tier: an elementary test whose every answer is true. A pure function but for the count, safe to
// call from any thread that runs in the default floating-point environment (Workers sees to it).
#pragma once

#include <cstdint>

#include "engine/elementary/query.h"
#include "engine/elementary/verdict.h"

namespace warmfront {

/// Do the closed convex hulls of the primitives meet at some t in [0, `latest`] of the linear motion, in real
/// arithmetic on the given doubles, and when first? For any finite coordinates and primitives however
/// degenerate:
///   - toi is the largest double not above the first time of contact;
///   - status is kHit, or kOverlapAtStart when toi is 0: contact at t = 0, or before the least positive
///   double.
///
/// A cascade whose stages answer only what is certain: the signs of the coplanarity cubic and inside tests in
/// double; exact integers on the stack where the coordinates of each axis span up to 124 bits; GMP on what is
/// left, counted in `exact_tests`. Only GMP allocates. Time is bounded, since integers are at most some 2100
/// bits an axis and roots are told apart by doubling precision: below 1 ms wherever the property tests look,
/// but for some 20 ms where each coordinate has an exponent of its own between -1074 and 1023.
Verdict exact_test(const FeatureVertices& features, double latest, std::uint64_t& exact_tests);

}  // namespace warmfront

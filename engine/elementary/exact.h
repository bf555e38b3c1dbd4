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
/// A cascade whose stages answer only what is certain: the certified tier's filters and inside tests in
/// double; exact integers on the stack where the coordinates of each axis span up to 124 bits; GMP on what is
/// left, and counted in `exact_tests`. Only GMP allocates. Time is bounded: see exact_test.cpp in tests for
/// the worst met.
Verdict exact_test(const FeatureVertices& features, double latest, std::uint64_t& exact_tests);

}  // namespace warmfront

// SPDX-License-Identifier: Apache-2.0
// The certified tier: an elementary test that never misses. Pure functions, safe to call from any thread that
// runs in the default floating-point environment (Workers sees to it).
#pragma once

#include <cstdint>

#include "engine/elementary/query.h"
#include "engine/elementary/verdict.h"

namespace warmfront {

struct CertifiedOptions {
  double tolerance = 1e-6;     ///< relative to the query's size; rounding may add 2^-18: see below
  double min_separation = 0;   ///< scene units
  std::uint32_t budget = 512;  ///< windows looked at before the answer is kBudget
  double latest = 1;           ///< contacts after this time are of no interest (Report::kEarliest)
};

/// Do the primitives come within `min_separation` (0: touch) during the step? Stages T0-T3 of
/// reference/algorithms 3.6:
///   T0  swept 18-DOP, trimming the window of times; T1 sign of the coplanarity cubic; T1b separating
///   directions; T2  root windows of the cubic by clipping its Bernstein hull, leftmost first; T3 inside
///   tests per window.
///
/// Guarantees, for any finite input, degenerate primitives included:
///   - contact == false only if the primitives stay farther apart than `min_separation` throughout [0,
///   latest];
///   - toi <= the exact first time of contact;
///   - kHit: contact is proved (within the step, at or after toi). Otherwise, except for kBudget, the
///   primitives come within min_separation + (2 tolerance + 2^-18) * size right after toi (the size: largest
///   coordinate difference between the two primitives' vertices at t = 0 and 1). The 2^-18 is tested, not
///   derived, and needed only where thin or parallel primitives graze: there directions decide, and one known
///   to u / gap tilts small gaps away;
///   - toi == 0 is always reported as kOverlapAtStart;
///   - at most `budget` windows, no allocation.
Verdict certified_test(const FeatureVertices& features, const CertifiedOptions& options);

/// The share of a pair's size, beyond min_separation, that the test may report at.
inline double certified_reach(double tolerance) {
  return 2 * tolerance + 0x1p-18;
}
/// A direction that separates a pair at the middle of a window separates it for as long as the pair needs to
/// move its gap. So windows narrower than twice the gap over the motion are excluded, and one that moves less
/// than so many times its gap takes at most twice as many windows: half of the budget.
inline constexpr double kSurelyDecided = 128;

}  // namespace warmfront

// SPDX-License-Identifier: Apache-2.0
// The certified tier: an elementary test that never misses. Pure functions, safe to call from any thread that
// runs in the default floating-point environment (Workers sees to it).
#pragma once

#include <cstdint>

#include "engine/elementary/query.h"
#include "engine/elementary/verdict.h"

namespace warmfront {

struct CertifiedOptions {
  double tolerance = 1e-6;     ///< relative to the query's size; rounding may add 2^-18
  double min_separation = 0;   ///< scene units
  std::uint32_t budget = 512;  ///< windows examined before the answer is kBudget
  double latest = 1;           ///< later contacts are not searched for (Report::kEarliest)
};

/// Do the primitives come within `min_separation` (0: touch) during the step? Stages T0-T3 of
/// reference/algorithms 3.6:
///   T0  swept 18-DOP, trims the time window; T1 sign of the coplanarity cubic; T1b separating directions;
///   T2  root windows of the cubic by clipping its Bernstein hull, leftmost first; T3 inside tests per
///   window.
///
/// Guarantees for any finite input, degenerate primitives included (proofs: README.md):
///   - contact == false only if the primitives stay farther apart than `min_separation` throughout [0,
///   latest];
///   - toi <= the exact first time of contact;
///   - kHit: contact is proved (within the step, at or after toi). Any other status except kBudget: the
///   primitives come within min_separation + certified_reach() * size at toi (size: largest coordinate
///   difference between vertices of the two primitives at t = 0 and 1);
///   - toi == 0 is always reported as kOverlapAtStart;
///   - whatever the budget, a pair is not reported if one direction keeps it farther apart than that for the
///   whole step, nor at a time up to which one does, nor if it stays farther apart and moves little
///   (kSurelyDecided);
///   - at most `budget` windows, and 640 more before the answer is kBudget; no allocation.
Verdict certified_test(const FeatureVertices& features, const CertifiedOptions& options);

/// The same after stage T0, of a query of positive size with a separation of its own (options.min_separation
/// is not looked at): in the window that T0, by a separation no smaller, has left.
Verdict certified_search(const Query& query, const CertifiedOptions& options, const Window& window);

/// An upper bound of the distance of a query's primitives at t, in its units: of points that are in them up
/// to 2^-44. `closest` is closest_direction() at t.
inline double distance_above(const Vec3& closest) {
  return norm(closest) * (1 + 0x1p-50) + 0x1p-44;
}

/// The fraction of a pair's size, beyond min_separation, within which the test may report: motion inside a
/// window that is not subdivided further, plus the error of distances. The test reports at half of this; the
/// other half covers the rounding of culls, which see the pair in another frame.
inline double certified_reach(double tolerance) {
  return tolerance + 0x1p-18;
}
/// A pair is never reported, not even as kBudget, if its primitives stay farther apart than the reach
/// throughout the step and their relative motion is less than this factor times the gap's excess over
/// min_separation.
inline constexpr double kSurelyDecided = 128;

}  // namespace warmfront

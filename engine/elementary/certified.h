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
///   primitives come within min_separation + certified_reach() * size at toi (the size: largest coordinate
///   difference between the two primitives' vertices at t = 0 and 1);
///   - toi == 0 is always reported as kOverlapAtStart;
///   - nothing is reported of a pair that one direction keeps farther apart than that for the whole step, nor
///   of one that stays farther apart and moves little (kSurelyDecided), whatever the budget;
///   - at most `budget` windows, and 640 more before kBudget is the answer; no allocation.
/// Proofs: README.md.
Verdict certified_test(const FeatureVertices& features, const CertifiedOptions& options);

/// The share of a pair's size, beyond min_separation, that the test may report at: what moves within a window
/// that it looks no further into, and what distances are known to. It reports at half of this; the other half
/// is room for the roundings of culls, which see the pair in another frame.
inline double certified_reach(double tolerance) {
  return tolerance + 0x1p-18;
}
/// Nothing is reported, kBudget included, of primitives that stay farther apart than the reach throughout the
/// step and move, relative to each other, less than so many times what the gap has beyond min_separation.
inline constexpr double kSurelyDecided = 128;

}  // namespace warmfront

// SPDX-License-Identifier: Apache-2.0
// A separation that follows from each pair's own distance at t = 0: how far may all go before any pair comes
// nearer than a share of what it was? Pure values and functions, safe to call from any thread that runs in
// the default floating-point environment (Workers checks it).
#pragma once

#include "engine/elementary/certified.h"
#include "engine/elementary/query.h"
#include "engine/elementary/verdict.h"

namespace warmfront {

/// A pair that is d apart at t = 0 is in contact when it comes within m + s (d - m); where d <= m, within m.
struct KeepDistance {
  double share = 0;   ///< s, in (0, 1); 0: nothing of the kind is asked
  double beyond = 0;  ///< m, in scene units, finite and >= 0

  /// The widest separation that matters between primitives whose points travel at most so far: what comes
  /// nearer than m + s (d - m) has (1 - s) (d - m) <= far_a + far_b, so m + s (d - m) is at most
  /// m + s / (1 - s) (far_a + far_b). Rounded up, and monotone in both; m where neither moves.
  double widest(double far_a, double far_b) const;

  friend bool operator==(const KeepDistance&, const KeepDistance&) = default;
};

/// When do the primitives come within their own separation? As certified_test() with that as min_separation,
/// rounded up by some 2^-43 of the query's size, but for three things:
///   - the separation is never wider than widest() of the two primitives. Where that is less than m + s (d -
///   m), the pair never comes as near as either. So a pair that stays beyond D = widest() of the scene's
///   longest ways is beyond its own separation: what leaves out pairs by a D that all share leaves out none
///   that is reported here (README.md, "Each pair's own separation");
///   - the tolerance is at most 2^-7 of what the pair may approach, (1 - s) (d - m): no pair stops a motion
///   because it is small beside its features;
///   - what is not provably beyond its own separation at t = 0 is kOverlapAtStart at once.
/// A function of the pair, of s, m and the tolerance alone.
Verdict keep_distance_test(const FeatureVertices& features, const KeepDistance& keep,
                           CertifiedOptions options);

}  // namespace warmfront

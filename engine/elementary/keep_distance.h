// SPDX-License-Identifier: Apache-2.0
// A separation that follows from each pair's own distance at t = 0: how far may all go before any pair comes
// nearer than a share of what it was? Pure values and functions, safe to call from any thread that runs in
// the default floating-point environment (Workers checks it).
#pragma once

#include <array>

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
  /// At least the separation of pairs that are no farther apart at t = 0 than that; infinite for infinite.
  double of_distance(double distance) const {
    return distance > beyond ? (beyond + share * (distance - beyond)) * (1 + 0x1p-40) : beyond;
  }

  friend bool operator==(const KeepDistance&, const KeepDistance&) = default;
};

/// The corners of a face or an edge, of which one is given twice then.
using Corners = std::array<std::array<double, 4>, 3>;
/// No feature of one is farther from a feature of the other than that: no farther than any corner of the one
/// from any of the other, as starts_apart() has it, but for the 2^-44 of a pair's size that this may be more:
/// what goes by it leaves out only what is beyond by certified_reach(). Rounded up, as farthest_apart() of
/// kept_room.h is, which is no less for boxes around both; infinite for what is not a number.
double farthest_features(const Corners& f, const Corners& g);
/// Squares of lengths far below this are lost.
inline constexpr double kTooSmall = 0x1p-449;
/// An upper bound of how far apart a query's primitives are at t = 0, in its units: up to 2^-44, no more than
/// any two of their vertices, nor than the points between which `closest`, closest_direction() at 0, leads.
double starts_apart(const Query& query, const Vec3& closest);

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

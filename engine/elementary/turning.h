// SPDX-License-Identifier: Apache-2.0
// Elementary tests of what moves along a screw: a helix is cut into pieces, each of which is near its chord.
// Pure functions except for the counts, safe to call from any thread in the default floating-point
// environment (Workers checks it).
#pragma once

#include "engine/elementary/certified.h"
#include "engine/elementary/half_space.h"
#include "engine/elementary/keep_distance.h"
#include "engine/elementary/query.h"
#include "engine/elementary/verdict.h"
#include "engine/motion/arcs.h"

namespace warmfront {

/// A pair of features, and the twists of either; null for one that moves along lines.
struct TurningPair {
  const FeatureVertices& features;
  const Twist* first = nullptr;
  const Twist* second = nullptr;
};

/// When do the primitives come within `min_separation` (0: touch), at times up to options.latest? Between s
/// and s + h every point of a primitive is within h^2 |p| / 8 of where its chord has it (screw.h), since a
/// point of a face is the same mean of its corners on the arc and on the chord. So if the chords stay farther
/// apart than that of both primitives beyond the separation, by certified_test(), the arcs do; else the piece
/// is halved, the earlier half first, until its arcs are within the tolerance of their chords. The first
/// piece begins where conservative advancement along the arcs ends.
///
/// As certified_test():
///   - contact == false only if the primitives stay farther apart than `min_separation` throughout [0,
///   latest]; toi is no later than the first time at which they do not;
///   - kHit only with a separation: they come within it. Any other status except kBudget: at toi they come
///   within the separation + (tolerance + 2 certified_reach()) * L, where L is the largest coordinate of any
///   vertex at either end from where the first one begins, and the bends of both on top;
///   - a pair is not reported where certified_test() would report none on lines with `min_separation` and the
///   arcs of both parts (Arc::most), so that culls which go by this leave out nothing;
///   - at most `kMostPieces` pieces before the answer is kBudget, with the time up to which none was found.
Verdict turning_test(const TurningPair& pair, const CertifiedOptions& options);
inline constexpr int kMostPieces = 1024;

/// As keep_distance_test(), with the distance at t = 0.
Verdict turning_keep_distance_test(const TurningPair& pair, const KeepDistance& keep,
                                   CertifiedOptions options);

/// Do the arcs come within `separation` at any time, of which they start farther apart by turning_slack() at
/// least? What conservative advancement along the arcs keeps apart, as where they move apart, needs no
/// search; true, too, where neither can tell.
bool turning_comes_within(const TurningPair& pair, double separation);
/// More than that rounds.
double turning_slack(const TurningPair& pair);

/// What bounds know: as candidate_test(), with the arcs of both.
Verdict turning_candidate_test(const TurningPair& pair, double min_separation);

/// Of a vertex on an arc and a half-space, which moves along lines. L: the largest coordinate of what the
/// vertex and the half-space's point move by, and the vertex's bend on top.
Verdict turning_half_space_test(const VertexMotion& vertex, const Twist& twist,
                                const HalfSpaceMotion& half_space, const ElementaryOptions& options,
                                ElementaryCounts& counts);
Verdict turning_half_space_keep_distance(const VertexMotion& vertex, const Twist& twist,
                                         const HalfSpaceMotion& half_space, const KeepDistance& keep,
                                         const ElementaryOptions& options, ElementaryCounts& counts);
bool turning_half_space_comes_within(const VertexMotion& vertex, const Twist& twist,
                                     const HalfSpaceMotion& half_space, double separation,
                                     ElementaryCounts& counts);
double turning_half_space_slack(const VertexMotion& vertex, const Twist& twist,
                                const HalfSpaceMotion& half_space);
Verdict turning_half_space_candidate(const VertexMotion& vertex, const Twist& twist,
                                     const HalfSpaceMotion& half_space, const ElementaryOptions& options,
                                     ElementaryCounts& counts);

/// Where a vertex on an arc is at time s.
std::array<double, 4> on_arc(const VertexMotion& vertex, const Twist& twist, double s);

}  // namespace warmfront

// SPDX-License-Identifier: Apache-2.0
// How near each other a pair of primitives starts, and whether they come nearer. Pure functions, safe to call
// from any thread in the default floating-point environment (Workers checks it).
#pragma once

#include <algorithm>

#include "engine/elementary/elementary_test.h"
#include "engine/elementary/half_space.h"
#include "engine/elementary/query.h"

namespace warmfront {

/// The largest coordinate difference between vertices of the two primitives, or between the vertex and the
/// half-space's point, at either end; at most a sixteenth of double's range.
double pair_size(const FeatureVertices& features);
double pair_size(const VertexMotion& vertex, const HalfSpaceMotion& half_space);

/// A pair at t = 0, in the scene's unit.
struct StartGap {
  double least = 0;  ///< a lower bound of its distance, within some 2^-46 of the size unless degenerate
  double size = 0;   ///< pair_size()
  double arcs = 0;   ///< turning_slack() of what moves along arcs

  /// How much nearer a pair may come than `least` and still count as coming no nearer: more than the tests
  /// below round.
  double slack() const { return std::max(0x1p-45 * size, arcs); }
};

/// `most` (>= 0): what `least` need not be above.
StartGap start_gap(const FeatureVertices& features, double most);
StartGap start_gap(const VertexMotion& vertex, const HalfSpaceMotion& half_space);

/// Are they within `separation` (>= 0) at t = 0? By exact arithmetic.
bool starts_within(const FeatureVertices& features, double separation, ElementaryCounts& counts);
bool starts_within(const VertexMotion& vertex, const HalfSpaceMotion& half_space, double separation,
                   ElementaryCounts& counts);

/// Do they come within `separation` (>= 0) at any time, as the exact tier decides? What the direction between
/// the closest points at t = 0 keeps apart, as where they move apart or along, needs no search, and neither
/// does what is nearer at one of a few times. Where they are near beside their size, doubles know that
/// direction better by the features that the points are on than by the points, as of which the elementary
/// tests look for it.
bool comes_within(const FeatureVertices& features, double separation, ElementaryCounts& counts);
bool comes_within(const VertexMotion& vertex, const HalfSpaceMotion& half_space, double separation,
                  ElementaryCounts& counts);

/// Does that direction separate the boxes that the motions of the vertices are in, each from its start to its
/// end? Then it separates the primitives wherever in its box each vertex is: so whatever rounding a commit
/// does that leaves it there, or beside it by less than 2^-50 of the largest coordinate.
bool keeps_its_side(const FeatureVertices& features);
/// The same, with the half-space's normal; false where that moves.
bool keeps_its_side(const VertexMotion& vertex, const HalfSpaceMotion& half_space);

/// Are they apart along an axis at t = 0, and is no vertex nearer to the others along it than at its start,
/// wherever a commit leaves it? By comparisons of coordinates, none of which rounds. Of vertices whose
/// coordinates differ from their start only in the sense in which their end does
/// (CommitRoom::leave_straight()). What touches is on neither side.
bool parts_by_axis(const FeatureVertices& features);
/// Does no coordinate of such a vertex go against the normal of a half-space that does not move? It comes no
/// nearer then, and goes no deeper, from wherever it starts.
bool goes_with_normal(const VertexMotion& vertex, const HalfSpaceMotion& half_space);
/// Does it start in a half-space that does not move, deeper than roundings, and end as deep or less? No
/// rounding takes it through what it is through.
bool is_inside_and_goes_no_deeper(const VertexMotion& vertex, const HalfSpaceMotion& half_space);

}  // namespace warmfront

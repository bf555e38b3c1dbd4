// SPDX-License-Identifier: Apache-2.0
// How near each other a pair of primitives starts, and whether they come nearer. Pure functions, safe to call
// from any thread in the default floating-point environment (Workers checks it).
#pragma once

#include <algorithm>

#include "engine/elementary/half_space.h"
#include "engine/elementary/query.h"

namespace warmfront {

/// A pair at t = 0, in the scene's unit.
struct StartGap {
  double least = 0;  ///< a lower bound of its distance, within some 2^-46 of the size unless degenerate
  /// The largest coordinate difference between vertices of the two, or the vertex and the half-space's point,
  /// at either end; infinite beyond double's range.
  double size = 0;

  /// How much nearer a pair may come than it starts and still counts as coming no nearer: what is given, and
  /// more than finding the distance rounds.
  double slack(double given) const { return std::max(given, 0x1p-42 * size); }
};

/// `most` (>= 0): what `least` need not be above.
StartGap start_gap(const FeatureVertices& features, double most);
StartGap start_gap(const VertexMotion& vertex, const HalfSpaceMotion& half_space);

/// Does the direction between the closest points at t = 0 keep the primitives farther apart than that
/// throughout, as it does where they move apart, or along? Where they are near each other beside their size,
/// doubles know the direction better by the features that the points are on than by the points, as of which
/// the elementary tests look for it.
bool stays_apart(const FeatureVertices& features, double separation);

/// Are the primitives nearer than that at one of a few times, as doubles prove? Then no search for the first
/// time is needed.
bool is_within(const FeatureVertices& features, double separation);

}  // namespace warmfront

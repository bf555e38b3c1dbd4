// SPDX-License-Identifier: Apache-2.0
// The bounds of a vertex, or of several, within a step, thickened by half the minimum separation. Pure
// function.
#pragma once

#include <cstdint>
#include <span>

#include "engine/bounds/kdop.h"
#include "engine/bounds/point_bounds.h"
#include "engine/motion/motion.h"
#include "engine/motion/moving_points.h"

namespace warmfront {

/// The vertex's 18-DOPs at t = 0 and t = 1 in the local frame, thickened so that two such bounds are apart
/// only if the vertices stay farther apart than `min_separation` (scene units) along some axis, by a margin.
///
/// The margin makes the bounds weaker than the elementary cascade's own test of the same nine axes
/// (trim_by_kdop in elementary/query.h), which works on coordinate differences: whatever the hierarchy
/// rejects, that test rejects too, so no answer depends on the hierarchy or its frame. Derivation: let M be
/// `magnitude`, common to all vertices, at least every local coordinate and the separation. A local
/// coordinate is one difference and exact scalings, so it carries u M of rounding, a diagonal sum 4 u M, its
/// thickening 3 u M. The cascade's slack is 48 u times a query size that is at most twice the largest gap,
/// and gaps are at most 2 M: 192 u M, to which come u times a diagonal's own threshold. 2^-44 M = 512 u M on
/// each of two sides covers all of it.
KDop18 moving_bounds(const VertexMotion& vertex, const LocalTransform& frame, double min_separation,
                     double magnitude);

/// What stands in bounds that are to be brought to this step.
enum class Known : std::uint8_t {
  kNothing,    ///< all are made anew
  kOlder,      ///< what did not change: the rest is made anew
  kLastStep,   ///< the step before this: where a vertex was then at t = 1, it is now at t = 0
  kLastTrial,  ///< the trial before this, from the same base: what is known of t = 0 holds
};

/// The same in fewer bytes, and wider by little: its 18-DOPs, which are sums in float32, hold those above.
/// With u = 2^-24 and a the largest local coordinate, one is off by u a in float32, a sum of two by 4 u a,
/// and an end, when the margin m is taken from it, by u (2 a + m) more: 6 u a in all, less than the 8 u a
/// that the margin has beside the thickening and what rounding takes of it. A vertex farther out than 2^100
/// is bounded by everything.
PointBounds point_bounds(const VertexMotion& vertex, const LocalTransform& frame, double min_separation,
                         double magnitude);

/// The same for many vertices of the given states; `bounds` has room for as many. With the frame, separation
/// and magnitude that made what is known.
void point_bounds(std::span<const VertexMotion> vertices, std::span<const MotionState> states,
                  const LocalTransform& frame, double min_separation, double magnitude, Known known,
                  PointBounds* bounds);

/// The same for a ball of the given radius (scene units) about a moving centre: it bounds whatever stays
/// within the ball at both ends of the step, up to rounding of 2^-44 of the magnitude.
KDop18 moving_bounds(const VertexMotion& centre, double radius, const LocalTransform& frame,
                     double min_separation, double magnitude);

/// The same for all of a small part's vertices.
KDop18 moving_bounds(const MovingPoints& points, const LocalTransform& frame, double min_separation,
                     double magnitude);

}  // namespace warmfront

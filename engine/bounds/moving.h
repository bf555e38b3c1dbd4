// SPDX-License-Identifier: Apache-2.0
// The bounds of one or several vertices within a step. Pure functions.
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
/// The separation counts half for each of two, and makes up for its own rounding. PointBounds, and the
/// hierarchies made of them, have none: there it is added where two are compared (width.h).
///
/// The margin makes the bounds weaker than the elementary cascade's own test of the same nine axes
/// (trim_by_kdop in elementary/query.h), which works on coordinate differences: that test rejects every pair
/// that the hierarchy rejects, so no answer depends on the hierarchy or its frame. Derivation: let M be
/// `magnitude`, common to all vertices, at least every local coordinate. A local coordinate is one
/// difference and exact scalings, so its rounding is u M, a diagonal sum's 4 u M. The cascade's slack is 48 u
/// times a query size that is at most twice the largest gap, and gaps are at most 2 M: 192 u M. 2^-44 M = 512 u
/// M on each of two sides covers all of it. A diagonal's own threshold is off by u of itself, which 2^-20 of
/// it, or 2^-40 where it is in double, covers. Besides, a trial may end kBesideTheWay M beside its way in each coordinate
/// (motion/trial_way.h), twice that along a diagonal: the margin has as much more.
KDop18 moving_bounds(const VertexMotion& vertex, const LocalTransform& frame, double min_separation,
                     double magnitude);

/// What the given bounds hold before they are updated to this step.
enum class Known : std::uint8_t {
  kNothing,    ///< nothing valid: all are recomputed
  kOlder,      ///< valid for unchanged vertices: the others are recomputed
  kLastStep,   ///< the previous step: a vertex's position at t = 1 there is now its position at t = 0
  kLastTrial,  ///< the previous trial from the same base: t = 0 is valid for all, t = 1 for unchanged vertices
};

/// The same without a separation in fewer bytes, and slightly wider: its 18-DOPs, which are sums in float32,
/// contain those above.
/// With u = 2^-24 and a the largest local coordinate, the error is u a in float32, 4 u a for a sum of two,
/// and u (2 a + m) more for an end, when the margin m is subtracted: 6 u a in all, less than the 8 u a that
/// the margin has beyond the thickening and its own rounding. A vertex farther out than 2^100 is bounded by
/// everything.
PointBounds point_bounds(const VertexMotion& vertex, const LocalTransform& frame, double magnitude);

/// The same for many vertices with the given states; `bounds` must have the same size. Frame and magnitude must
/// be those of the known bounds.
void point_bounds(std::span<const VertexMotion> vertices, std::span<const MotionState> states,
                  const LocalTransform& frame, double magnitude, Known known, PointBounds* bounds);

/// A hierarchy's root as a part's bounds, thickened as those of moving_bounds().
template <class Bounds>
Bounds thickened(Bounds bounds, const LocalTransform& frame, double min_separation);

/// The same for a ball of the given radius (scene units) about a moving centre: bounds everything that is
/// within the ball at both ends of the step, up to rounding of 2^-44 of the magnitude.
KDop18 moving_bounds(const VertexMotion& centre, double radius, const LocalTransform& frame,
                     double min_separation, double magnitude);

/// The same for all vertices of a small part.
KDop18 moving_bounds(const MovingPoints& points, const LocalTransform& frame, double min_separation,
                     double magnitude);

}  // namespace warmfront

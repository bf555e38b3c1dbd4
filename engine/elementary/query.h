// SPDX-License-Identifier: Apache-2.0
// One elementary query in local, scaled coordinates, and the times at which a direction separates it. Pure
// values and functions.
#pragma once

#include <array>

#include "engine/contact.h"
#include "engine/elementary/vec3.h"
#include "engine/motion/motion.h"

namespace warmfront {

/// A feature pair's vertices: vertex and face (0 | 1 2 3), or edge and edge (0 1 | 2 3).
struct FeatureVertices {
  ContactKind kind;
  std::array<const VertexMotion*, 4> vertex;
};

/// A closed range of times.
struct Window {
  double begin = 0;
  double end = 1;
  double width() const { return end - begin; }
};

/// A query in coordinates relative to vertex 0, scaled by a power of two so that its size is in [0.5, 1).
///
/// Differences of input coordinates carry one rounding each (relative u); scaling is exact but for underflow,
/// which is below 2^-1074 of the size. So every length here has a relative error of at most u, plus 2^-1074.
struct Query {
  ContactKind kind;
  /// Vertices 1, 2, 3 relative to vertex 0.
  std::array<MovingVec3, 3> from0;
  /// From a vertex of the first primitive to a vertex of the second: 3 (vertex-face) or 4 (edge-edge).
  std::array<MovingVec3, 4> gaps;
  int gap_count;
  /// Largest coordinate of the gaps, in [0.5, 1); 0 when all gaps vanish.
  double size;
  /// Bound on the motion, over the whole step, of any point of one primitive relative to any point of the
  /// other.
  double relative_motion;
  /// Minimum separation, scaled and rounded up; 0 for none.
  double separation;
  /// What scales: powers of two.
  int exponent;
  double prescale;

  static Query prepare(const FeatureVertices& features, double min_separation);
  /// A length >= 0 in the query's units, rounded up: 0 for 0. For a query of positive size.
  double scaled(double length) const;
  /// The other way, rounded down.
  double unscaled(double length) const;
};

/// All times at which one direction separates.
struct SeparatedTimes {
  bool any = false;
  Window times;  ///< meaningful only if any
};

/// The times at which `direction` provably keeps the second primitive beyond the first by more than the
/// separation. Each projected gap is linear in t, so these times form one interval (reference/algorithms 3.5
/// and 3.6 T0: directional advancement).
///
/// Error bound, in units of size 1: a dot product of three terms has at most 4 roundings on values with one
/// input rounding, 5 u * 3 |w|; interpolation and the quotient for the crossing act on the value less the
/// slack 48 u |w|, and each end of the interval not shared with [0, 1] is then moved inward by 2^-50.
SeparatedTimes separated_times(const Query& query, const Vec3& direction);

/// How far a direction keeps all gaps at t = 0 beyond the origin, in the query's units, rounded down.
///
/// Error bound as that of separated_times(): a dot product, of values with one rounding, is off by less than
/// 24 u |w|_max for gaps below 1, and the norm by a few u of itself; |w|_max <= norm(w).
double kept_along(const Query& query, const Vec3& direction);

/// Trims the separated times off the ends of `window`. Returns false when nothing is left.
bool trim(Window& window, const SeparatedTimes& separated);

/// The moving 18-DOP stage: trims by the nine axes in both senses. Returns false when nothing is left.
bool trim_by_kdop(const Query& query, Window& window);

/// From the closest point of the first primitive to that of the second at time t (approximate: any direction
/// is valid).
Vec3 closest_direction(const Query& query, double t);

}  // namespace warmfront

// SPDX-License-Identifier: Apache-2.0
// The 18-DOP swept by a vertex within a step, thickened by half the minimum separation. Pure function.
#pragma once

#include "engine/bounds/kdop.h"
#include "engine/motion/motion.h"

namespace warmfront {

/// The 18-DOP, in the local frame, of the segment from t = 0 to t = 1, thickened so that two such bounds are
/// disjoint only if the vertices stay farther apart than `min_separation` (scene units) along some axis, by a
/// margin.
///
/// The margin makes the bounds weaker than the elementary cascade's own test of the same nine axes
/// (elementary/query.h, separated_times), which works on coordinate differences: whatever the hierarchy
/// rejects, that test rejects too, so no answer depends on the hierarchy. Derivation: let m be the largest
/// magnitude among the raw coordinates, the origin and min_separation, in local units. A local coordinate
/// carries at most 4 u m of rounding (u = 2^-53), a diagonal sum 10 u m, its thickening 4 u m; the cascade's
/// slack is at most 48 u times a difference of at most 2 m, twice that on a diagonal. 2^-44 m = 512 u m on
/// each side covers all of it.
KDop18 swept_vertex(const VertexMotion& vertex, const LocalFrame& frame, double min_separation);

}  // namespace warmfront

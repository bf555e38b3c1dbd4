// SPDX-License-Identifier: Apache-2.0
// A vertex and a half-space in integers of any size. A pure function, safe to call from any thread; it
// allocates, and throws std::bad_alloc.
#pragma once

#include "engine/elementary/half_space.h"

namespace warmfront {

/// half_space_test() in tier exact, for every time and all doubles: kHit, or kOverlapAtStart. What is not finite
/// counts as overlapping.
Verdict exact_half_space_test(const VertexMotion& vertex, const HalfSpaceMotion& half_space,
                              double separation);

}  // namespace warmfront

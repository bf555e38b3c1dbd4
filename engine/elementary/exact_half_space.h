// SPDX-License-Identifier: Apache-2.0
// A vertex and a half-space in integers. A pure function except for the count, safe to call from any thread;
// where only long integers decide it allocates, and throws std::bad_alloc.
#pragma once

#include <cstdint>

#include "engine/elementary/half_space.h"

namespace warmfront {

/// half_space_test() in tier exact, for every time and all doubles: kHit, or kOverlapAtStart. What is not
/// finite counts as overlapping. `exact_tests` grows by one where only integers of any size decide.
Verdict exact_half_space_test(const VertexMotion& vertex, const HalfSpaceMotion& half_space,
                              double separation, std::uint64_t& exact_tests);

}  // namespace warmfront

// SPDX-License-Identifier: Apache-2.0
// The true answer to an elementary query, computed independently of the engine's tiers: whether, and when
// first, zero lies in the convex hull of the vertices' differences, decided at algebraic times in integers of
// any length. Slow (a fraction of a millisecond, more at extreme scales) and without tolerance. Pure
// functions, no shared state.
#pragma once

#include "engine/elementary/query.h"

namespace warmfront::testing {

struct ExactTruth {
  bool contact = false;
  bool at_start = false;   ///< the first time is 0 itself
  bool toi_exact = false;  ///< the first time is a double: `toi`
  double toi = 0;          ///< the largest double not above the first time; meaningful only if contact
};

/// Do the closed convex hulls of the primitives meet at some t in [0, 1] of the linear motion, and when
/// first? For any finite coordinates, degenerate primitives included.
ExactTruth exact_truth(const FeatureVertices& features);

}  // namespace warmfront::testing

// SPDX-License-Identifier: Apache-2.0
// Inside tests: where on the primitives the four coplanar points would meet, as signs of quartics over a time
// window. Pure functions. Source: reference/algorithms 3.2 (TightCCD), conditions as in 3.6. Error bounds:
// README.md.
#pragma once

#include "engine/elementary/query.h"

namespace warmfront {

enum class Inside {
  kNo,       ///< the primitives meet at no time of the window
  kYes,      ///< at every time of the window, coplanar implies meeting
  kUnknown,  ///< neither is certain
};

/// Vertex-face: barycentric numerators w = ((b-p) x (c-p)).n and its rotations, all >= 0 when they meet.
/// Edge-edge: g1 = ((c-a) x h).n and g2 = ((c-a) x e).n, with e, h the edges and n = e x h: 0 <= g <= n.n
/// when they meet. Each is necessary, also for degenerate primitives (all vanish); all strict together are
/// sufficient. Each is a quartic in t within 2048 u L^3, L the largest coordinate of the vectors. Requires no
/// minimum separation.
Inside inside(const Query& query, const Window& window);

/// inside() over the times within `reach` of t, from the signs at t alone: a fifth of the work, and as good
/// where the reach is a few roundings. Adds 256 m L^3 to the error bound, m = relative_motion * reach <= 2^-8
/// L.
Inside inside_around(const Query& query, double t, double reach);

}  // namespace warmfront

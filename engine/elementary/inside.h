// SPDX-License-Identifier: Apache-2.0
// Inside tests: where on the primitives the four coplanar points would meet, as signs of quartics over a
// window of times. Pure functions. Source: reference/algorithms 3.2 (TightCCD), conditions as in 3.6.
#pragma once

#include "engine/elementary/query.h"

namespace warmfront {

enum class Inside {
  kNo,       ///< at no time of the window can the primitives meet
  kYes,      ///< at every time of the window coplanar means meeting
  kUnknown,  ///< neither is certain
};

/// Vertex-face: barycentric numerators w = ((b-p) x (c-p)).n and its rotations, all >= 0 when they meet.
/// Edge-edge: g1 = ((c-a) x h).n and g2 = ((c-a) x e).n, with e, h the edges and n = e x h: 0 <= g <= n.n
/// when they meet. Each is necessary for degenerate primitives too (then all vanish), and together, all
/// strict, sufficient.
///
/// Each is a quartic in t, the product of two quadratic Beziers. Error bound: with L the largest coordinate
/// of the vectors at the window's ends (each within 4 u, scaled query of size 1; an edge, of size up to 2,
/// within 8 u; differences of two within 10 u), the cross products are within 34 u L, the normal within 100 u
/// L (vertex-face) or 44 u L (edge-edge), the dot products and their Bernstein combinations within 1400 u
/// L^3; 2048 u L^3 is used. Requires no minimum separation.
Inside inside(const Query& query, const Window& window);

/// inside() over the times within `reach` of t, from the signs at t alone: a fifth of the work, and as good
/// where the reach is some roundings.
///
/// Error bound: over the reach no gap's coordinate moves by more than m = relative_motion * reach, and no
/// edge's by more than 2 m. With m <= 2^-8 L, b x c (of at most 2 L^2) changes by at most 4.01 m L and the
/// normal (8 L^2) by 16.1 m L, so vertex-face numerators change by at most 3 (2 * 16.1 + 8 * 4.01 + 0.3) m
/// L^3 < 194 m L^3; edge-edge, (c-a) x h and (c-a) x e (2 L^2) by 6.1 m L and n (2 L^2) by 8.1 m L, so
/// numerators by 86 m L^3, n.n by 98 m L^3, and their difference by 184 m L^3. 256 m L^3 is used, beside the
/// 2048 u L^3 of rounding as in inside().
Inside inside_around(const Query& query, double t, double reach);

}  // namespace warmfront

// SPDX-License-Identifier: Apache-2.0
// The coplanarity cubic of four moving points, in Bernstein form with a forward error bound. Pure functions.
// Source: Provot 1997 (coplanarity); Tang, Manocha, Tong 2010 (non-penetration filter);
// reference/algorithms 3.1.
#pragma once

#include <array>

#include "engine/elementary/query.h"

namespace warmfront {

/// f(t) = det(p1, p2, p3)(t) = sum of coefficient[i] * C(3,i) (1-t)^(3-i) t^i, every coefficient within
/// `error`.
///
/// Error bound. With A, B, C the largest coordinates of p1, p2, p3 at either time (inputs relative to vertex
/// 0, one rounding each, relative u): K0 = p1(0).(p2(0) x p3(0)) has 6 products; per product 3 u of input, 1
/// u for the product in the cross product, 1 u for its difference, 1 u for the product in the dot product and
/// 2 u for its sums: 8 u. K1 has 18 products and two more sums (crosses are added before the dot product, dot
/// products after): 10 u. So |K0 error| <= 6 * 8.01 u ABC and |K1 error| <= 18 * 10.01 u ABC; as coefficients
/// k0 = K0 and k1 = K1 / 3 (one more rounding): at most 67 u ABC. 112 u ABC is used; it also covers the
/// rounding of ABC itself. Underflow: at most 60 products of operands below 1 (scaled query), each within
/// 2^-1074: 2^-1000 covers them.
struct Cubic {
  std::array<double, 4> coefficient;
  double error;
  /// Largest |coefficient|.
  double magnitude;
  /// Bound on |n(t)| times the separation, by which f may be off zero in contact; 0 without separation.
  double slack;

  explicit Cubic(const Query& query);

  /// Where in `window` the convex hull of the control points, each widened by error and slack, meets zero: no
  /// time outside is a root. Returns false when nowhere.
  ///
  /// Coefficients on the window come from the original ones by blossoming: three levels of (1-t) a + t b, 3 u
  /// each and a non-negative combination, so 9 u * magnitude; 16 u is used. Crossings are solved with a
  /// relative error below 8 u of a parameter in [0, 1]; the result is widened by 2^-49.
  bool clip(Window& window) const;

  /// True when f has certain, opposite signs at the window's ends: it has a root within.
  bool certain_sign_change(const Window& window) const;

  /// f at t, and the Bernstein coefficients on a window: each within certain().
  double at(double t) const;
  std::array<double, 4> on(const Window& window) const;
  double certain() const { return error + 16 * kUnit * magnitude; }
};

}  // namespace warmfront

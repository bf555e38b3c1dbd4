// SPDX-License-Identifier: Apache-2.0
// The coplanarity cubic of four moving points, in Bernstein form with a forward error bound. Pure functions.
// Source: Provot 1997 (coplanarity); Tang, Manocha, Tong 2010 (non-penetration filter);
// reference/algorithms 3.1.
#pragma once

#include <array>

#include "engine/elementary/query.h"

namespace warmfront {

/// f(t) = det(p1, p2, p3)(t) = sum of coefficient[i] * C(3,i) (1-t)^(3-i) t^i, every coefficient within
/// `error`: 112 u ABC + 2^-1000, with A, B, C the largest coordinates of p1, p2, p3 at either time
/// (README.md, "Error bounds").
struct Cubic {
  std::array<double, 4> coefficient;
  double error;
  /// Largest |coefficient|.
  double magnitude;
  /// Bound on |n(t)| times the separation: how far f may be from zero in contact; 0 without separation.
  double slack;

  explicit Cubic(const Query& query);

  /// Shrinks `window` to where the convex hull of the control points, each widened by error and slack, meets
  /// zero: no time outside is a root. Returns false when nothing is left. Error bound: README.md.
  bool clip(Window& window) const;

  /// True when f has certain, opposite signs at the window's ends: it has a root within.
  bool certain_sign_change(const Window& window) const;

  /// f at t, and the Bernstein coefficients on a window: each within certain().
  double at(double t) const;
  std::array<double, 4> on(const Window& window) const;
  double certain() const { return error + 16 * kUnit * magnitude; }
};

}  // namespace warmfront

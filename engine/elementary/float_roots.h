// SPDX-License-Identifier: Apache-2.0
// The roots of a cubic in plain floating point, approximate: proposals for exact tests. Pure functions.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>

namespace warmfront {

/// A cubic, from its Bernstein coefficients, as c0 + t (c1 + t (c2 + t c3)).
struct PowerCubic {
  double c0;
  double c1;
  double c2;
  double c3;

  explicit PowerCubic(const std::array<double, 4>& k)
      : c0(k[0]),
        c1(3 * (k[1] - k[0])),
        c2(3 * (k[2] - 2 * k[1] + k[0])),
        c3(k[3] - 3 * (k[2] - k[1]) - k[0]) {}
  double at(double t) const { return c0 + t * (c1 + t * (c2 + t * c3)); }
  double slope(double t) const { return c1 + t * (2 * c2 + t * (3 * c3)); }
};

/// The root of f in [begin, end], at whose ends f has different signs (or is zero): Newton steps while they
/// stay within the bracket, else bisection.
inline double root_between(const PowerCubic& f, double begin, double end, double at_begin) {
  double t = 0.5 * (begin + end);
  for (int i = 0; i < 60; ++i) {
    const double value = f.at(t);
    if (value == 0) return t;
    ((value > 0) == (at_begin > 0) ? begin : end) = t;
    double next = t - value / f.slope(t);
    if (!(next > begin && next < end)) next = 0.5 * (begin + end);
    if (std::fabs(next - t) <= 0x1p-40) return next;  // the next step would be about its square
    t = next;
  }
  return t;
}

/// The critical points of f in (0, 1), ascending, with 0 before and 1 after them.
struct Turns {
  std::array<double, 4> time{0, 1};
  int count = 2;

  explicit Turns(const PowerCubic& f) {
    const double half = f.c2;
    const double discriminant = half * half - 3 * f.c3 * f.c1;
    if (!(discriminant > 0)) return;
    const double q = -(half + std::copysign(std::sqrt(discriminant), half));
    double first = q / (3 * f.c3);
    double second = f.c1 / q;
    if (first > second) std::swap(first, second);
    count = 1;
    if (first > 0 && first < 1) time[count++] = first;
    if (second > 0 && second < 1) time[count++] = second;
    time[count++] = 1;
  }
};

}  // namespace warmfront

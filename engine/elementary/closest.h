// SPDX-License-Identifier: Apache-2.0
// Closest points in floating point, without guarantees: they propose directions that are then proved. Their
// barycentric coordinates are clamped, so the result is always in the primitives (up to rounding). Source:
// Ericson, Real-Time Collision Detection, sections 5.1.5 and 5.1.9. Pure functions.
#pragma once

#include <algorithm>
#include <array>

#include "engine/elementary/vec3.h"

namespace warmfront {

/// Where the point of the segment (a, b) closest to the origin is: 0 at a, 1 at b.
inline double closest_share(const Vec3& a, const Vec3& b) {
  const Vec3 ab = b - a;
  const double length = dot(ab, ab);
  return length > 0 ? std::clamp(-dot(ab, a) / length, 0.0, 1.0) : 0.0;
}

/// The point of the segment (a, b) closest to the origin.
inline Vec3 closest_on_segment(const Vec3& a, const Vec3& b) {
  return a + closest_share(a, b) * (b - a);
}

/// A point of the triangle (a, b, c): on its side from corner `from` to corner `to`, at `share` of the way;
/// or, if they are equal, in its interior, a + share (b - a) + of_c (c - a).
struct TrianglePoint {
  int from = 0;
  int to = 0;
  double share = 0;
  double of_c = 0;
};

/// The point of the triangle (a, b, c) closest to the origin.
inline TrianglePoint closest_in_triangle(const Vec3& a, const Vec3& b, const Vec3& c) {
  const Vec3 ab = b - a;
  const Vec3 ac = c - a;
  const double d1 = -dot(ab, a);
  const double d2 = -dot(ac, a);
  if (d1 <= 0 && d2 <= 0) return {0, 1, 0};
  const double d3 = -dot(ab, b);
  const double d4 = -dot(ac, b);
  if (d3 >= 0 && d4 <= d3) return {1, 2, 0};
  const double vc = d1 * d4 - d3 * d2;
  if (vc <= 0 && d1 >= 0 && d3 <= 0 && d1 > d3) return {0, 1, d1 / (d1 - d3)};
  const double d5 = -dot(ab, c);
  const double d6 = -dot(ac, c);
  if (d6 >= 0 && d5 <= d6) return {2, 0, 0};
  const double vb = d5 * d2 - d1 * d6;
  if (vb <= 0 && d2 >= 0 && d6 <= 0 && d2 > d6) return {0, 2, d2 / (d2 - d6)};
  const double va = d3 * d6 - d5 * d4;
  const double toward_c = d4 - d3;
  const double toward_b = d5 - d6;
  if (va <= 0 && toward_c >= 0 && toward_b >= 0 && toward_c + toward_b > 0)
    return {1, 2, toward_c / (toward_c + toward_b)};
  const double sum = va + vb + vc;
  const Vec3 n = cross(ab, ac);
  // A needle: its areas are only rounding. Use its edges.
  if (!(sum > 0) || dot(n, n) <= 0x1p-40 * dot(ab, ab) * dot(ac, ac)) {
    const std::array<const Vec3*, 3> corner{&a, &b, &c};
    TrianglePoint nearest;
    double least = 0;
    for (int side = 0; side < 3; ++side) {
      const Vec3& p = *corner[side];
      const Vec3& q = *corner[(side + 1) % 3];
      const double share = closest_share(p, q);
      const Vec3 x = p + share * (q - p);
      if (side > 0 && !(dot(x, x) < least)) continue;
      least = dot(x, x);
      nearest = {side, (side + 1) % 3, share};
    }
    return nearest;
  }
  const double v = std::clamp(vb / sum, 0.0, 1.0);
  return {0, 0, v, std::clamp(vc / sum, 0.0, 1.0 - v)};
}

/// The same as a point ...
inline Vec3 closest_on_triangle(const Vec3& a, const Vec3& b, const Vec3& c) {
  const TrianglePoint at = closest_in_triangle(a, b, c);
  if (at.from == at.to) return a + at.share * (b - a) + at.of_c * (c - a);
  const std::array<const Vec3*, 3> corner{&a, &b, &c};
  const Vec3& p = *corner[at.from];
  return at.share > 0 ? p + at.share * (*corner[at.to] - p) : p;
}

/// ... and by its barycentric coordinates, of which exact zeros tell the corner or side that it is on.
inline std::array<double, 3> closest_weights(const Vec3& a, const Vec3& b, const Vec3& c) {
  const TrianglePoint at = closest_in_triangle(a, b, c);
  if (at.from == at.to) return {1 - at.share - at.of_c, at.share, at.of_c};
  std::array<double, 3> weights{};
  weights[at.from] = 1 - at.share;
  weights[at.to] = at.share;
  return weights;
}

/// Parameters in [0, 1] of the closest points of the segments (0, e) and (g, q).
inline std::array<double, 2> closest_shares(const Vec3& e, const Vec3& g, const Vec3& q) {
  const Vec3 h = q - g;
  const double ee = dot(e, e);
  const double hh = dot(h, h);
  const double eh = dot(e, h);
  const double eg = dot(e, g);
  const double hg = dot(h, g);
  const double denominator = ee * hh - eh * eh;
  // Parallel edges: start from any point of the first.
  double s = denominator > 0 ? std::clamp((eg * hh - eh * hg) / denominator, 0.0, 1.0) : 0.0;
  double r = hh > 0 ? (s * eh - hg) / hh : 0.0;
  // The second edge is a point: only the first parameter is unknown.
  if (r < 0 || !(hh > 0)) {
    r = 0;
    s = ee > 0 ? std::clamp(eg / ee, 0.0, 1.0) : 0.0;
  } else if (r > 1) {
    r = 1;
    s = ee > 0 ? std::clamp((eg + eh) / ee, 0.0, 1.0) : 0.0;
  }
  return {s, r};
}

/// From the closest point of the segment (0, e) to that of the segment (g, q).
inline Vec3 closest_between_edges(const Vec3& e, const Vec3& g, const Vec3& q) {
  const auto [s, r] = closest_shares(e, g, q);
  return (g + r * (q - g)) - s * e;
}

/// The direction, scaled to a largest coordinate of 1: the slack of separated_times() grows with the
/// direction, and a tiny direction's dot products would be lost in the underflow guard. Below 2^-900: 0,
/// which separates nothing.
inline Vec3 normalised(const Vec3& direction) {
  const double largest = max_abs(direction);
  return largest > 0x1p-900 ? (1 / largest) * direction : Vec3{0, 0, 0};
}

}  // namespace warmfront

// SPDX-License-Identifier: Apache-2.0
#include "tests/support/distance.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace warmfront::testing {
namespace {

using Real = long double;
using Point = std::array<Real, 3>;

Point operator-(const Point& a, const Point& b) {
  return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}
Real dot(const Point& a, const Point& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}
Point cross(const Point& a, const Point& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
Real norm(const Point& a) {
  return std::sqrt(dot(a, a));
}

Real to_segment(const Point& p, const Point& a, const Point& b) {
  const Point along = b - a;
  const Real length2 = dot(along, along);
  const Real s = length2 > 0 ? std::clamp(dot(p - a, along) / length2, Real{0}, Real{1}) : Real{0};
  return norm(p - Point{a[0] + s * along[0], a[1] + s * along[1], a[2] + s * along[2]});
}

Real to_triangle(const Point& p, const Point& a, const Point& b, const Point& c) {
  const Real rim = std::min({to_segment(p, a, b), to_segment(p, b, c), to_segment(p, c, a)});
  const Point n = cross(b - a, c - a);
  const bool inside = dot(cross(b - a, p - a), n) >= 0 && dot(cross(c - b, p - b), n) >= 0 &&
                      dot(cross(a - c, p - c), n) >= 0;
  return inside && norm(n) > 0 ? std::min(rim, std::abs(dot(p - a, n)) / norm(n)) : rim;
}

Real between_edges(const Point& a, const Point& b, const Point& c, const Point& d) {
  const Real rim =
      std::min({to_segment(a, c, d), to_segment(b, c, d), to_segment(c, a, b), to_segment(d, a, b)});
  const Point n = cross(b - a, d - c);
  const Real n2 = dot(n, n);
  if (!(n2 > 0)) return rim;
  const Real s = dot(cross(c - a, d - c), n) / n2;
  const Real r = dot(cross(c - a, b - a), n) / n2;
  const bool inside = s >= 0 && s <= 1 && r >= 0 && r <= 1;
  return inside ? std::min(rim, std::abs(dot(c - a, n)) / std::sqrt(n2)) : rim;
}

}  // namespace

long double relative_distance(const FeatureVertices& features, double t) {
  const int first_of_other = features.kind == ContactKind::kVertexFace ? 1 : 2;
  const auto gap = [&](int from, int to, int axis, std::array<double, 4> VertexMotion::*end) {
    return Real{(features.vertex[to]->*end)[axis]} - Real{(features.vertex[from]->*end)[axis]};
  };
  Real size = 0;
  std::array<Point, 4> p{};
  for (int axis = 0; axis < 3; ++axis) {
    for (int k = 1; k < 4; ++k) {
      p[k][axis] =
          (1 - Real{t}) * gap(0, k, axis, &VertexMotion::t0) + Real{t} * gap(0, k, axis, &VertexMotion::t1);
    }
    for (int a = 0; a < first_of_other; ++a) {
      for (int b = first_of_other; b < 4; ++b) {
        for (const auto end : {&VertexMotion::t0, &VertexMotion::t1})
          size = std::max(size, std::abs(gap(a, b, axis, end)));
      }
    }
  }
  if (size == 0) return 0;
  for (Point& point : p) {
    for (Real& x : point) x /= size;
  }
  return first_of_other == 1 ? to_triangle(p[0], p[1], p[2], p[3]) : between_edges(p[0], p[1], p[2], p[3]);
}

}  // namespace warmfront::testing

// SPDX-License-Identifier: Apache-2.0
#include "engine/elementary/edge_face.h"

#include <algorithm>
#include <cmath>

#include "engine/elementary/exact.h"
#include "engine/elementary/exact_polygon.h"
#include "engine/elementary/vec3.h"

namespace warmfront {
namespace {

using Point = std::array<double, 4>;

const Point& standing(const VertexMotion& vertex, Instant at) {
  return at == Instant::kStart ? vertex.t0 : vertex.t1;
}

// The sign of det(b - a, c - a, d - a), or kUnknownSign.
//
// Error bound: that of the cubic's first coefficient (README.md, "Error bounds"), 6 products of 8.01 u each
// of the three largest coordinates. A product that underflows errs by 2^-1075 and is multiplied by one
// coordinate at most. A product may overflow where the bound does not: then the sum is infinite or no number,
// and says nothing of the sign.
int certain_orientation(const Point& a, const Point& b, const Point& c, const Point& d) {
  const auto from_a = [&](const Point& x) { return Vec3{x[0] - a[0], x[1] - a[1], x[2] - a[2]}; };
  const Vec3 p = from_a(b);
  const Vec3 q = from_a(c);
  const Vec3 r = from_a(d);
  const double det = dot(p, cross(q, r));
  if (!std::isfinite(det)) return kUnknownSign;
  const double size = max_abs(p);
  const double bound = 64 * kUnit * size * max_abs(q) * max_abs(r) + 0x1p-1060 * (1 + size);
  return det > bound ? 1 : det < -bound ? -1 : kUnknownSign;
}

FeatureVertices standing_four(ContactKind kind, const std::array<VertexMotion, 5>& all,
                              const std::array<int, 4>& which) {
  FeatureVertices features{kind, {}};
  for (std::size_t k = 0; k < 4; ++k) features.vertex[k] = &all[static_cast<std::size_t>(which[k])];
  return features;
}

template <class Width>
int orientation_in(const FeatureVertices& four, const CoordinateBits& bits) {
  return DifferencePolygon<Width>(four, bits).volume().c[0].sign();
}

// In integers, what doubles leave open.
class Exact {
 public:
  Exact(const EdgeFaceVertices& vertices, Instant at, std::uint64_t& exact_tests)
      : exact_tests_(exact_tests) {
    for (std::size_t k = 0; k < 5; ++k) all_[k].t0 = all_[k].t1 = standing(*vertices[k], at);
  }
  Exact(const Exact&) = delete;
  Exact& operator=(const Exact&) = delete;

  // The sign of det(b - a, c - a, d - a).
  int orientation(int a, int b, int c, int d) {
    const FeatureVertices four = standing_four(ContactKind::kVertexFace, all_, {a, b, c, d});
    const CoordinateBits bits(four);
    if (NarrowWidth::fits(bits)) return orientation_in<NarrowWidth>(four, bits);
    if (FixedWidth<1>::fits(bits)) return orientation_in<FixedWidth<1>>(four, bits);
    if (FixedWidth<2>::fits(bits)) return orientation_in<FixedWidth<2>>(four, bits);
    ++exact_tests_;
    return orientation_in<AnyWidth>(four, bits);
  }

  bool touch(ContactKind kind, const std::array<int, 4>& four) {
    return exact_test(standing_four(kind, all_, four), 0, exact_tests_).contact;
  }

 private:
  std::array<VertexMotion, 5> all_;
  std::uint64_t& exact_tests_;
};

}  // namespace

bool edge_meets_face(const EdgeFaceVertices& vertices, Instant at, std::uint64_t& exact_tests) {
  const auto x = [&](int k) -> const Point& { return standing(*vertices[static_cast<std::size_t>(k)], at); };
  Exact exact(vertices, at, exact_tests);
  const auto orientation = [&](int a, int b, int c, int d) {
    const int sign = certain_orientation(x(a), x(b), x(c), x(d));
    return sign == kUnknownSign ? exact.orientation(a, b, c, d) : sign;
  };
  // Edge 0 1, face 2 3 4. Both ends on one side of the face's plane?
  const int p = orientation(0, 2, 3, 4);
  const int q = orientation(1, 2, 3, 4);
  if (p * q > 0) return false;
  if (p == 0 && q == 0) {
    // In one plane, or the face is on a line: they meet where an end is in the face, or the edge meets a
    // side.
    for (const int end : {0, 1}) {
      if (exact.touch(ContactKind::kVertexFace, {end, 2, 3, 4})) return true;
    }
    for (const auto& side : {std::array{0, 1, 2, 3}, std::array{0, 1, 3, 4}, std::array{0, 1, 4, 2}}) {
      if (exact.touch(ContactKind::kEdgeEdge, side)) return true;
    }
    return false;
  }
  // The edge's line crosses the plane in one point, which is in the edge; and in the face, unless it passes
  // two of its sides on different sides.
  const std::array turns{orientation(0, 1, 2, 3), orientation(0, 1, 3, 4), orientation(0, 1, 4, 2)};
  return *std::ranges::min_element(turns) >= 0 || *std::ranges::max_element(turns) <= 0;
}

}  // namespace warmfront

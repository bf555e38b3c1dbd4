// SPDX-License-Identifier: Apache-2.0
// How far the origin is from the polygon of differences between two primitives (exact_polygon.h), compared
// with a separation in integers: a polynomial in time for each corner, side and interior. Over Fixed and over
// Big. Not thread-safe: one thread at a time.
//
// The distance between the primitives is that of the origin from the polygon P_0, P_1, ..., a triangle or a
// parallelogram. With e_i = P_i+1 - P_i, N = e_0 x e_1, C_i = P_i x P_i+1 and the separation s:
//   corner i:   its distance is <= s while |P_i|^2 - s^2 <= 0;
//   side i:     of its line, while |C_i|^2 - s^2 |e_i|^2 <= 0; the line's nearest point is in the side while
//               -P_i . e_i >= 0 and P_i+1 . e_i >= 0, of which one is positive (their sum is |e_i|^2, which
//               is 0 where the side is a point);
//   interior:   of its plane, while (P_0 . N)^2 - s^2 |N|^2 <= 0; the plane's nearest point is in the polygon
//               while no C_i . N is negative and one is positive (their sum is |N|^2, or twice that, which is
//               0 where the polygon is on a line).
#pragma once

#include "engine/elementary/exact_polygon.h"

namespace warmfront {

template <class A, int kA, class B, int kB>
auto operator*(const Polynomial<A, kA>& a, const Polynomial<B, kB>& b) {
  using Int = decltype(a.c[0] * b.c[0]);
  Polynomial<Int, kA + kB> product;
  product.c.fill(Int(0));
  for (int i = 0; i <= kA; ++i)
    for (int j = 0; j <= kB; ++j) product.c[i + j] = product.c[i + j] + a.c[i] * b.c[j];
  return product;
}
template <class Int, int kDegree>
Polynomial<Int, kDegree> operator+(Polynomial<Int, kDegree> a, const Polynomial<Int, kDegree>& b) {
  for (int i = 0; i <= kDegree; ++i) a.c[i] = a.c[i] + b.c[i];
  return a;
}
template <class Int, int kA, int kB>
requires(kB <= kA) Polynomial<Int, kA>
operator-(Polynomial<Int, kA> a, const Polynomial<Int, kB>& b) {
  for (int i = 0; i <= kB; ++i) a.c[i] = a.c[i] - b.c[i];
  return a;
}

/// Integers of one width, as FixedWidth; the separation is one of the lengths that fit. With k = 64 W - 3,
/// coefficients are below
///   |P|^2 - s^2, P . e: 2^(2k + 4.6), in 2 W limbs;
///   |C|^2 - s^2 |e|^2: 9 2^(4k + 6) + 9 2^(4k + 2) < 2^(4k + 9.3), and C . N as much, in 4 W;
///   (P . N)^2 - s^2 |N|^2: 8640 2^6k + 27 2^(6k + 6) < 2^(6k + 13.4), in 6 W.
/// The sums of all coefficients are at most four times as much, as evaluate() needs.
template <int kWords>
struct NearWidth : FixedWidth<kWords> {
  using Quartic = Fixed<4 * kWords>;
  using Sextic = Fixed<6 * kWords>;
};
struct AnyNearWidth : AnyWidth {
  using Quartic = Big;
  using Sextic = Big;
};

template <class Width>
class NearPolygon {
 public:
  using Linear = typename Width::Linear;
  using Quadratic = Polynomial<typename Width::Quadratic, 2>;
  using Quartic = Polynomial<typename Width::Quartic, 4>;
  using Sextic = Polynomial<typename Width::Sextic, 6>;

  /// `bits` are those of the features and the separation.
  NearPolygon(const FeatureVertices& features, double separation, const CoordinateBits& bits)
      : polygon_(features, bits) {
    const auto s = integer_of<Linear>(separation, bits.lowest[0]);
    square_.c[0] = s * s;
  }

  int sides() const { return polygon_.sides(); }

  Quadratic corner(int i) const {
    Quadratic excess = dot(polygon_.point(i), polygon_.point(i));
    excess.c[0] = excess.c[0] - square_.c[0];
    return excess;
  }

  struct Side {
    Quartic excess;
    std::array<Quadratic, 2> within;  ///< neither negative, one positive
  };
  Side side(int i) const {
    const auto e = along(i);
    Side side;
    side.excess = square_of(turn(i)) - square_ * dot(e, e);
    side.within[0] = dot(polygon_.point(i), e);
    for (auto& x : side.within[0].c) x = -x;
    side.within[1] = dot(polygon_.point(i + 1), e);
    return side;
  }

  Sextic interior() const {
    const auto f = polygon_.volume();
    return f * f - square_ * square_of(normal());
  }
  /// C_i . N for all sides.
  std::array<Quartic, 4> within() const {
    const Quadratics n = normal();
    std::array<Quartic, 4> within{};
    for (int i = 0; i < sides(); ++i) within[i] = dot(turn(i), n);
    return within;
  }

 private:
  using Edge = std::array<Polynomial<Linear, 1>, 3>;
  using Quadratics = std::array<Quadratic, 3>;

  Edge along(int i) const {
    Edge e;
    for (int axis = 0; axis < 3; ++axis) e[axis] = polygon_.point(i + 1)[axis] - polygon_.point(i)[axis];
    return e;
  }
  Quadratics turn(int i) const { return {polygon_.turn(i, 0), polygon_.turn(i, 1), polygon_.turn(i, 2)}; }
  Quadratics normal() const {
    const Edge a = along(0);
    const Edge b = along(1);
    Quadratics n;
    for (int axis = 0; axis < 3; ++axis) {
      const int j = (axis + 1) % 3;
      const int k = (axis + 2) % 3;
      n[axis] = a[j] * b[k] - a[k] * b[j];
    }
    return n;
  }
  template <class Vector>
  static auto dot(const Vector& a, const Vector& b) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
  }
  static Quartic square_of(const Quadratics& a) { return dot(a, a); }

  DifferencePolygon<Width> polygon_;
  Polynomial<typename Width::Quadratic, 0> square_;  // of the separation
};

}  // namespace warmfront

// SPDX-License-Identifier: Apache-2.0
// An elementary query in integers: the polygon of differences between its primitives, and when it contains
// the origin. Over Fixed and over Big. Not thread-safe: one thread at a time.
//
// A vertex p meets a face (a, b, c) when the origin is in the triangle P = (a-p, b-p, c-p); an edge (a, b)
// meets an edge (c, d) when it is in their Minkowski difference, the parallelogram P = (c-a, d-a, d-b, c-b).
// With C_i = P_i x P_i+1 and N their sum (two or four times the area's normal), at a time when the origin
// lies in the polygon's plane:
//   N != 0: it is inside when no C_i points against N. Any axis k with N_k != 0 decides this, since the
//   projection
//           along k maps the plane one to one;
//   N == 0: all P_i are on a line, and the closed walk P_0, P_1, ... covers their hull: the origin is in it
//   when it
//           is on one of the sides, C_i = 0 and P_i . P_i+1 <= 0.
// Scaling an axis changes neither answer, so each axis has its own power of two.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>

#include "engine/elementary/exact/exact_roots.h"
#include "engine/elementary/query.h"

namespace warmfront {

/// Per axis, the exponent of the lowest bit set in any coordinate, and how many bits the coordinates span.
struct CoordinateBits {
  std::array<int, 3> lowest;
  int span;

  explicit CoordinateBits(const FeatureVertices& features);
  /// With one exponent for all axes, and for a length: where distances count.
  CoordinateBits(const FeatureVertices& features, double length);
};

/// A double in units of 2^lowest, of which it is a multiple.
template <class Linear>
Linear integer_of(double x, int lowest) {
  const auto bits = std::bit_cast<std::uint64_t>(x);
  const auto exponent = static_cast<int>(bits >> 52) & 2047;
  auto mantissa = static_cast<std::int64_t>(bits & ((std::uint64_t{1} << 52) - 1));
  if (exponent != 0) mantissa |= std::int64_t{1} << 52;
  if (mantissa == 0) return Linear(0);
  // mantissa * 2^(max(exponent, 1) - 1075), in units of 2^lowest: the right shift drops only zeros.
  const int shift = std::max(exponent, 1) - 1075 - lowest;
  if (shift < 0) mantissa >>= -shift;
  const Linear whole(x < 0 ? -mantissa : mantissa);
  return shift > 0 ? whole << shift : whole;
}

/// The integers of one width: coordinates below 2^(64 W - 4) in magnitude. Differences P(0) and P(1) are
/// below 2^k, k = 64 W - 3, and P(1) - P(0) is below 2^(k+1). Then
///   C_i, P_i . P_i+1: coefficients below 2^(2k+1), 2^(2k+3), 2^(2k+3) and 3 2^2k, 3 2^(2k+2), 3 2^(2k+2);
///   N: four times as much, so all within 2^(2k+5) = 2^(128 W - 1);
///   f: below 3 2^(3k+1), 36 2^3k, 72 2^3k, 48 2^3k, within 2^(3k+6.2) = 2^(192 W - 2.8).
/// So they fit in 2 W and 3 W limbs, which also satisfies evaluate() and discriminant_sign().
template <int kWords>
struct FixedWidth {
  using Linear = Fixed<kWords>;
  using Quadratic = Fixed<2 * kWords>;
  using Cubic = Fixed<3 * kWords>;
  static bool fits(const CoordinateBits& bits) { return bits.span <= 64 * kWords - 4; }
};
/// Narrower still, for coordinates below 2^39, as in most scenes: k = 40, and f is within 2^126.2.
struct NarrowWidth {
  using Linear = Fixed<1>;
  using Quadratic = Fixed<2>;
  using Cubic = Fixed<2>;
  static bool fits(const CoordinateBits& bits) { return bits.span <= 39; }
};
struct AnyWidth {
  using Linear = Big;
  using Quadratic = Big;
  using Cubic = Big;
};

template <class Width>
class DifferencePolygon {
 public:
  using Linear = typename Width::Linear;
  using Quadratic = Polynomial<typename Width::Quadratic, 2>;
  using Cubic = Polynomial<typename Width::Cubic, 3>;

  DifferencePolygon(const FeatureVertices& features, const CoordinateBits& bits)
      : sides_(features.kind == ContactKind::kVertexFace ? 3 : 4) {
    constexpr std::array<std::array<int, 2>, 3> kVertexFace{{{1, 0}, {2, 0}, {3, 0}}};
    constexpr std::array<std::array<int, 2>, 4> kEdgeEdge{{{2, 0}, {3, 0}, {3, 1}, {2, 1}}};
    for (int axis = 0; axis < 3; ++axis) {
      std::array<Linear, 4> t0;
      std::array<Linear, 4> t1;
      for (int v = 0; v < 4; ++v) {
        t0[v] = integer_of<Linear>(features.vertex[v]->t0[axis], bits.lowest[axis]);
        t1[v] = integer_of<Linear>(features.vertex[v]->t1[axis], bits.lowest[axis]);
      }
      for (int i = 0; i < sides_; ++i) {
        const auto [to, from] = sides_ == 3 ? kVertexFace[i] : kEdgeEdge[i];
        p_[i][axis].c[0] = t0[to] - t0[from];
        p_[i][axis].c[1] = (t1[to] - t1[from]) - p_[i][axis].c[0];
      }
    }
  }

  int sides() const { return sides_; }
  /// P_i, after the last of which comes the first again.
  const std::array<Polynomial<Linear, 1>, 3>& point(int i) const { return p_[i % sides_]; }

  /// C_i along an axis.
  Quadratic turn(int side, int axis) const {
    const int j = (axis + 1) % 3;
    const int k = (axis + 2) % 3;
    const auto& p = p_[side];
    const auto& q = p_[(side + 1) % sides_];
    return {p[j].c[0] * q[k].c[0] - p[k].c[0] * q[j].c[0],
            (p[j].c[0] * q[k].c[1] - p[k].c[0] * q[j].c[1]) + (p[j].c[1] * q[k].c[0] - p[k].c[1] * q[j].c[0]),
            p[j].c[1] * q[k].c[1] - p[k].c[1] * q[j].c[1]};
  }

  /// P_i . P_i+1
  Quadratic along(int side) const {
    Quadratic sum{typename Width::Quadratic(0), typename Width::Quadratic(0), typename Width::Quadratic(0)};
    for (int axis = 0; axis < 3; ++axis) {
      const auto& p = p_[side][axis];
      const auto& q = p_[(side + 1) % sides_][axis];
      sum.c[0] = sum.c[0] + p.c[0] * q.c[0];
      sum.c[1] = sum.c[1] + (p.c[0] * q.c[1] + p.c[1] * q.c[0]);
      sum.c[2] = sum.c[2] + p.c[1] * q.c[1];
    }
    return sum;
  }

  /// det(P_0, P_1, P_2): zero where the origin is in the polygon's plane, or the polygon has no plane.
  Cubic volume() const {
    using Value = typename Width::Cubic;
    Cubic f{Value(0), Value(0), Value(0), Value(0)};
    for (int axis = 0; axis < 3; ++axis) {
      const Quadratic c = turn(1, axis);
      const auto& p = p_[0][axis];
      f.c[0] = f.c[0] + Value::product(c.c[0], p.c[0]);
      f.c[1] = f.c[1] + (Value::product(c.c[1], p.c[0]) + Value::product(c.c[0], p.c[1]));
      f.c[2] = f.c[2] + (Value::product(c.c[2], p.c[0]) + Value::product(c.c[1], p.c[1]));
      f.c[3] = f.c[3] + Value::product(c.c[2], p.c[1]);
    }
    return f;
  }

  /// Is the origin in the polygon, at a time when it is in the polygon's plane? `sign` gives the sign of a
  /// Quadratic at that time.
  template <class Sign>
  Answer holds_origin(Sign&& sign) const {
    for (int axis = 0; axis < 3; ++axis) {
      std::array<Quadratic, 4> turns{};
      for (int i = 0; i < sides_; ++i) turns[i] = turn(i, axis);
      Quadratic normal = turns[0];
      for (int i = 1; i < sides_; ++i)
        for (int j = 0; j < 3; ++j) normal.c[j] = normal.c[j] + turns[i].c[j];
      const int up = sign(normal);
      if (up == kUnknownSign) return Answer::kUnknown;
      if (up == 0) continue;
      bool unknown = false;
      for (int i = 0; i < sides_; ++i) {
        const int side = sign(turns[i]);
        if (side == -up) return Answer::kNo;
        unknown = unknown || side == kUnknownSign;
      }
      return unknown ? Answer::kUnknown : Answer::kYes;
    }
    return on_a_side(sign);
  }

  /// Is the origin on side i?
  template <class Sign>
  Answer on_side(int i, Sign&& sign) const {
    bool unknown = false;
    for (int axis = 0; axis < 3; ++axis) {
      const int side = sign(turn(i, axis));
      if (side == kUnknownSign)
        unknown = true;
      else if (side != 0)
        return Answer::kNo;
    }
    const int ahead = sign(along(i));
    if (ahead == 1) return Answer::kNo;
    return unknown || ahead == kUnknownSign ? Answer::kUnknown : Answer::kYes;
  }

 private:
  template <class Sign>
  Answer on_a_side(Sign&& sign) const {
    bool unknown = false;
    for (int i = 0; i < sides_; ++i) {
      const Answer answer = on_side(i, sign);
      if (answer == Answer::kYes) return answer;
      unknown = unknown || answer == Answer::kUnknown;
    }
    return unknown ? Answer::kUnknown : Answer::kNo;
  }

  int sides_;
  std::array<std::array<Polynomial<Linear, 1>, 3>, 4> p_;  // [point][axis]
};

}  // namespace warmfront

// SPDX-License-Identifier: Apache-2.0
#include "engine/elementary/exact_half_space.h"

#include <bit>
#include <cstdint>
#include <initializer_list>

#include "engine/elementary/exact/big_polynomial.h"
#include "engine/elementary/exact_polygon.h"
#include "engine/elementary/near_polygon.h"

namespace warmfront {
namespace {

using Quadratic = Polynomial<Big, 2>;
using Quartic = Polynomial<Big, 4>;

// The exponent of a unit of which all doubles that were added are multiples.
class Unit {
 public:
  void add(double x) {
    const auto bits = std::bit_cast<std::uint64_t>(x) << 1;
    if (bits == 0) return;
    const auto exponent = static_cast<int>(bits >> 53);
    const int zeros = std::min(52, std::countr_zero(bits) - 1);
    least_ = std::min(least_, std::max(exponent, 1) - 1075 + zeros);
  }
  int exponent() const { return least_ == kNone ? 0 : least_; }

 private:
  static constexpr int kNone = 4096;
  int least_ = kNone;
};

bool is_finite(const VertexMotion& vertex, const HalfSpaceMotion& half_space) {
  bool finite = true;
  for (std::size_t k = 0; k < 3; ++k) {
    finite = finite && std::isfinite(vertex.t0[k]) && std::isfinite(vertex.t1[k]);
    for (std::size_t end = 0; end < 2; ++end)
      finite = finite && std::isfinite(half_space.point[end][k]) && std::isfinite(half_space.normal[end][k]);
  }
  return finite;
}

// The largest double not above a / b, which is in (0, 1].
double floor_of_quotient(const Big& a, const Big& b) {
  // 54 bits and more of it, or all that doubles have.
  const int shift = std::min(1074, std::max(0, b.bits() - a.bits() + 55));
  return floor_divide(a << shift, b).floor_scaled(shift);
}

// The largest double not above the first root in (0, 1] of p, which is above 0 at 0; 2 without one.
double first_root(const Quadratic& p) {
  if (p.c[2].sign() == 0) {
    const Big slope = -p.c[1];
    return slope.sign() > 0 && (slope - p.c[0]).sign() >= 0 ? floor_of_quotient(p.c[0], slope) : 2;
  }
  double first = 2;
  visit_roots(p, [&](const auto&, const auto& root) {
    first = root.floor;
    return Answer::kYes;
  });
  return first;
}
double first_root(const Quartic& p) {
  if (p.c[4].sign() == 0 && p.c[3].sign() == 0) return first_root(Quadratic{{p.c[0], p.c[1], p.c[2]}});
  const roots::Coefficients f = roots::squarefree(roots::coefficients(p));
  double first = 2;
  roots::isolate_roots(f, dyadic_of<BigDyadic>(0), dyadic_of<BigDyadic>(1),
                       [&](const roots::IsolatedRoot& root) {
                         first = roots::floor_of_root(f, root);
                         return false;
                       });
  return first;
}

}  // namespace

// In integers: f = n . (x - p), and with a separation s, while f > 0, f^2 - s^2 |n|^2. Where both are above 0
// at t = 0, f cannot reach 0 before the latter does.
Verdict exact_half_space_test(const VertexMotion& vertex, const HalfSpaceMotion& half_space,
                              double separation) {
  if (!is_finite(vertex, half_space)) return Verdict::at(0, ContactStatus::kPossible);
  Unit of_length;
  Unit of_normal;
  of_length.add(separation);
  for (std::size_t k = 0; k < 3; ++k) {
    for (const double x : {vertex.t0[k], vertex.t1[k], half_space.point[0][k], half_space.point[1][k]})
      of_length.add(x);
    for (const double n : {half_space.normal[0][k], half_space.normal[1][k]}) of_normal.add(n);
  }
  const auto length = [&](double x) { return integer_of<Big>(x, of_length.exponent()); };
  const auto normal = [&](double x) { return integer_of<Big>(x, of_normal.exponent()); };

  Quadratic f;
  std::array<Polynomial<Big, 1>, 3> n;
  for (std::size_t k = 0; k < 3; ++k) {
    const Big d0 = length(vertex.t0[k]) - length(half_space.point[0][k]);
    const Big d1 = length(vertex.t1[k]) - length(half_space.point[1][k]);
    const Big n0 = normal(half_space.normal[0][k]);
    n[k] = {{n0, normal(half_space.normal[1][k]) - n0}};
    f = f + n[k] * Polynomial<Big, 1>{{d0, d1 - d0}};
  }
  if (f.c[0].sign() <= 0) return Verdict::at(0, ContactStatus::kHit);
  double toi = 2;
  if (separation == 0) {
    toi = first_root(f);
  } else {
    const Big s = length(separation);
    Quadratic square;  // s^2 |n|^2
    for (const auto& of_axis : n) square = square + of_axis * of_axis;
    for (Big& c : square.c) c = c * (s * s);
    const Quartic excess = f * f - square;
    if (excess.c[0].sign() <= 0) return Verdict::at(0, ContactStatus::kHit);
    toi = first_root(excess);
  }
  return toi <= 1 ? Verdict::at(toi, ContactStatus::kHit) : Verdict{};
}

}  // namespace warmfront

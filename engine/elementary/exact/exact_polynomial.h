// SPDX-License-Identifier: Apache-2.0
// Polynomials with integer coefficients, and their exact signs: at dyadic times, and between neighbouring
// doubles. Over Fixed and over Big. Pure functions.
#pragma once

#include <array>
#include <bit>
#include <cstdint>

#include "engine/elementary/exact/big.h"
#include "engine/elementary/exact/fixed.h"

namespace warmfront {

template <class Int, int kDegree>
struct Polynomial {
  std::array<Int, kDegree + 1> c;  ///< c[i] belongs to t^i

  bool is_zero() const {
    for (const Int& x : c)
      if (x.sign() != 0) return false;
    return true;
  }
};

/// A double in [0, 1] in units of its distance to the next double.
struct DoubleParts {
  std::uint64_t mantissa;  ///< t = mantissa / 2^ulp_shift, below 2^53
  int ulp_shift;           ///< 2^-ulp_shift is the distance to the next double
};

inline DoubleParts parts_of(double t) {
  const auto bits = std::bit_cast<std::uint64_t>(t);
  const auto exponent = static_cast<int>(bits >> 52);
  const std::uint64_t fraction = bits & ((std::uint64_t{1} << 52) - 1);
  if (exponent == 0) return {fraction, 1074};
  return {fraction | (std::uint64_t{1} << 52), 1075 - exponent};
}

template <class Dyadic>
Dyadic dyadic_of(double t);

template <>
inline SmallDyadic dyadic_of<SmallDyadic>(double t) {
  const auto [mantissa, ulp_shift] = parts_of(t);
  if (mantissa == 0) return {0, 0};
  const int zeros = std::countr_zero(mantissa);
  // ulp_shift >= zeros, as t <= 1.
  return {mantissa >> zeros, ulp_shift - zeros};
}

template <>
inline BigDyadic dyadic_of<BigDyadic>(double t) {
  const SmallDyadic small = dyadic_of<SmallDyadic>(t);
  return {Big(static_cast<std::int64_t>(small.numerator)), small.shift};
}

template <int kWords, class Int, int kDegree>
auto evaluate_in(const Polynomial<Int, kDegree>& p, const typename Int::Dyadic& t) {
  auto value = p.c[kDegree].template room<kDegree, kWords>();
  for (int i = kDegree; i-- > 0;) {
    value = value * t.numerator + (p.c[i].template room<kDegree, kWords>() << ((kDegree - i) * t.shift));
  }
  return value;
}

/// p(t) * 2^(kDegree * shift), by Horner's rule.
///
/// Over Fixed<N>: needs |c[0]| + ... + |c[kDegree]| < 2^(64 N + 1), t in [0, 1] and shift <= kMaxShift. With
/// W words a degree and shifts up to 63 W - 1 every intermediate value is below 2^(64 N + 1 + (63 W - 1)
/// kDegree), at most 2^(64 (N + W kDegree) - 1) for W = 2; for W = 1 the shift is at most 62.
template <class Int, int kDegree>
auto evaluate(const Polynomial<Int, kDegree>& p, const typename Int::Dyadic& t) {
  if constexpr (!Int::kUnbounded) {
    using Wide = decltype(evaluate_in<2>(p, t));
    // Few doubles, those below 2^-10, need the second word.
    if (t.shift <= 62) return evaluate_in<1>(p, t).template widened<Wide::kWidth>();
  }
  return evaluate_in<2>(p, t);
}

inline constexpr int kUnknownSign = 2;

/// The sign of the quadratic on all of [t, next double after t], or kUnknownSign where its Bernstein
/// coefficients there differ in sign. Needs ulp_shift(t) <= kMaxShift and the conditions of evaluate().
template <class Int>
int sign_over_ulp(const Polynomial<Int, 2>& p, double t) {
  const auto [mantissa, shift] = parts_of(t);
  // With x = 2^shift t: P(x) = c0 4^shift + c1 2^shift x + c2 x^2, from x = mantissa over a length of 1.
  const auto c0 = p.c[0].template room<2>() << (2 * shift);
  const auto c1 = p.c[1].template room<2>() << shift;
  const auto c2 = p.c[2].template room<2>();
  const auto first = (c2 * mantissa + c1) * mantissa + c0;
  const auto slope = c2 * (2 * mantissa) + c1;
  const int sign = first.sign();
  if (sign == 0 || (first + slope + c2).sign() != sign) return kUnknownSign;
  // The middle coefficient is first + slope / 2.
  return (first + first + slope).sign() == sign ? sign : kUnknownSign;
}

}  // namespace warmfront

// SPDX-License-Identifier: Apache-2.0
// The real roots in (0, 1] of a polynomial of degree at most 3 with integer coefficients: isolated, and each
// found as the largest double not above it. Over Fixed without allocation, where a rare root may stay
// unknown; over Big always. Pure functions.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <utility>

#include "engine/elementary/exact/exact_polynomial.h"
#include "engine/elementary/exact/root_floor.h"

namespace warmfront {

/// kUnknown comes from Fixed only: the caller then repeats the test over Big.
enum class Answer { kNo, kYes, kUnknown };

namespace roots {

inline int variations_in(const int* sign, int count) {
  int variations = 0;
  int last = 0;
  for (int i = 0; i < count; ++i) {
    variations += sign[i] * last < 0;
    if (sign[i] != 0) last = sign[i];
  }
  return variations;
}

/// Sign variations of f and its derivatives at t. Budan and Fourier: f has V(l) - V(r) roots in (l, r], or an
/// even number less; exactly that many if all its roots are real.
template <class Int, int kDegree>
int variations(const Polynomial<Int, kDegree>& f, const typename Int::Dyadic& t) {
  std::array<int, kDegree + 1> sign;
  sign[0] = evaluate(f, t).sign();
  sign[kDegree] = f.c[kDegree].sign();
  if constexpr (kDegree == 3) {
    const std::uint64_t two = 2;
    const std::uint64_t three = 3;
    sign[1] = evaluate(Polynomial<Int, 2>{{f.c[1], f.c[2] * two, f.c[3] * three}}, t).sign();
    sign[2] = evaluate(Polynomial<Int, 1>{{f.c[2], f.c[3] * three}}, t).sign();
  } else {
    sign[1] = evaluate(Polynomial<Int, 1>{{f.c[1], f.c[2] * std::uint64_t{2}}}, t).sign();
  }
  return variations_in(sign.data(), kDegree + 1);
}

template <class Int, int kDegree>
int variations_at_zero(const Polynomial<Int, kDegree>& f) {
  std::array<int, kDegree + 1> sign;
  for (int i = 0; i <= kDegree; ++i) sign[i] = f.c[i].sign();
  return variations_in(sign.data(), kDegree + 1);
}

/// By sums of coefficients: the Taylor coefficients at 1, by Horner's scheme. Over Fixed these fit
/// (FixedWidth); intermediate overflow beyond the highest limb cancels.
template <class Int, int kDegree>
int variations_at_one(Polynomial<Int, kDegree> f) {
  std::array<int, kDegree + 1> sign;
  for (int i = 0; i <= kDegree; ++i) {
    for (int j = kDegree; j-- > i;) f.c[j] = f.c[j] + f.c[j + 1];
    sign[i] = f.c[i].sign();
  }
  return variations_in(sign.data(), kDegree + 1);
}

/// The discriminant's sign. Degree 3: 18 abcd - 4 b^3 d + b^2 c^2 - 4 a c^3 - 27 a^2 d^2; with a = 0 it is
/// b^2 times that of the quadratic. Over Fixed<N>, coefficients below 2^(64 N - 1.8) keep it below 2^(256 N -
/// 1).
template <class Int>
int discriminant_sign(const Polynomial<Int, 3>& f) {
  const auto& [d, c, b, a] = f.c;
  const auto ad = a * d;
  const auto bc = b * c;
  const auto bb = b * b;
  const auto cc = c * c;
  const auto first = ad * bc * std::uint64_t{18} + bb * cc;
  const auto second = bb * (b * d) * std::uint64_t{4} + (a * c) * cc * std::uint64_t{4};
  return (first - second - ad * ad * std::uint64_t{27}).sign();
}
template <class Int>
int discriminant_sign(const Polynomial<Int, 2>& f) {
  const auto& [c, b, a] = f.c;
  return (b * b - a * c * std::uint64_t{4}).sign();
}

/// Points in (0, 1) near f's critical points, ascending, at which f is not zero: all of them with `precision`
/// bits after the point, or fewer.
template <class Int, int kDegree>
struct SplitPoints {
  std::array<typename Int::Dyadic, 2> at;
  int count = 0;
};

/// Over Fixed: doubles, `precision` is ignored.
template <int kLimbs, int kDegree>
SplitPoints<Fixed<kLimbs>, kDegree> split_points(const Polynomial<Fixed<kLimbs>, kDegree>& f,
                                                 int /*precision*/) {
  const Approximation<kDegree> approximation(f);
  const double c1 = approximation.c[1];
  const double c2 = approximation.c[2];
  const double c3 = kDegree == 3 ? approximation.c[kDegree] : 0;
  const double root = std::sqrt(std::max(0.0, c2 * c2 - 3 * c3 * c1));
  const double q = -(c2 + std::copysign(root, c2));
  std::array<double, 2> times{q / (3 * c3), c1 / q};
  if (times[0] > times[1]) std::swap(times[0], times[1]);
  SplitPoints<Fixed<kLimbs>, kDegree> points;
  for (const double t : times) {
    if (!(t > 0x1p-70 && t < 1)) continue;
    points.at[points.count] = dyadic_of<SmallDyadic>(t);
    points.count += evaluate(f, points.at[points.count]).sign() != 0;
  }
  return points;
}
SplitPoints<Big, 3> split_points(const Polynomial<Big, 3>& f, int precision);
SplitPoints<Big, 2> split_points(const Polynomial<Big, 2>& f, int precision);

/// For an f with a multiple root, whose roots are rational: polynomials with one root each, ascending, with
/// the roots of f.
struct LinearFactors {
  std::array<std::array<Big, 2>, 2> c;  ///< c[0] + c[1] t
  int count = 0;
};
LinearFactors linear_factors(const Polynomial<Big, 3>& f);
LinearFactors linear_factors(const Polynomial<Big, 2>& f);

/// Tarski's query: the sum of the signs of g at f's roots in (root.begin, root.end), of which there is one.
int tarski_query(const Polynomial<Big, 3>& f, const Polynomial<Big, 2>& g, const Root<Big>& root);
int tarski_query(const Polynomial<Big, 2>& f, const Polynomial<Big, 2>& g, const Root<Big>& root);

}  // namespace roots

/// Calls visit(f, root) for the roots of f in (0, 1], ascending, with f or a factor of it that has the root
/// as its only one there, until an answer is not kNo; returns that answer. f is not identically zero.
template <class Int, int kDegree, class Visit>
Answer visit_roots(Polynomial<Int, kDegree> f, Visit&& visit) {
  using Dyadic = typename Int::Dyadic;
  // Divide out roots at 0.
  while (f.c[0].sign() == 0) {
    for (int i = 0; i < kDegree; ++i) f.c[i] = f.c[i + 1];
    f.c[kDegree] = Int(0);
  }
  const Dyadic zero = dyadic_of<Dyadic>(0);
  const Dyadic one = dyadic_of<Dyadic>(1);
  const auto visit_only = [&](const Dyadic& begin, const Dyadic& end, int sign_before) {
    const auto root = roots::locate(f, begin, end, sign_before, nullptr);
    return root ? visit(f, *root) : Answer::kUnknown;
  };
  const int at_begin = roots::variations_at_zero(f);
  const int at_end = roots::variations_at_one(f);
  int count = at_begin - at_end;
  if (count == 0) return Answer::kNo;
  if (count > 1) {
    const int discriminant = roots::discriminant_sign(f);
    if (discriminant == 0) {
      if constexpr (Int::kUnbounded) {
        const roots::LinearFactors factors = roots::linear_factors(f);
        Answer answer = Answer::kNo;
        for (int i = 0; i < factors.count && answer == Answer::kNo; ++i) {
          Polynomial<Int, kDegree> factor;
          factor.c[0] = factors.c[i][0];
          factor.c[1] = factors.c[i][1];
          if (factor.c[0].sign() != 0) answer = visit_roots(std::move(factor), visit);
        }
        return answer;
      }
      return Answer::kUnknown;
    }
    // Two roots of a cubic, or of a quadratic, are complex: Budan and Fourier's count includes them.
    if (discriminant < 0) count %= 2;
    if (count == 0) return Answer::kNo;
  }
  if (count == 1) return visit_only(zero, one, f.c[0].sign());

  // All roots are real and simple, and f's critical points separate them: a sufficient precision shows it.
  for (int precision = 64;; precision *= 2) {
    const auto points = roots::split_points(f, precision);
    std::array<int, 4> count_at{at_begin, at_end};
    for (int i = 0; i < points.count; ++i) count_at[i + 1] = roots::variations(f, points.at[i]);
    count_at[points.count + 1] = at_end;
    bool apart = true;
    for (int i = 0; i <= points.count; ++i) apart = apart && count_at[i] - count_at[i + 1] <= 1;
    if (!apart) {
      if constexpr (!Int::kUnbounded) return Answer::kUnknown;
      continue;
    }
    int sign = f.c[0].sign();
    for (int i = 0; i <= points.count; ++i) {
      if (count_at[i] == count_at[i + 1]) continue;
      const Answer answer =
          visit_only(i == 0 ? zero : points.at[i - 1], i == points.count ? one : points.at[i], sign);
      if (answer != Answer::kNo) return answer;
      sign = -sign;
    }
    return Answer::kNo;
  }
}

/// The sign of g at the root of f; kUnknownSign from Fixed only.
template <class Int, int kDegree, class Coefficient>
int sign_at(const Polynomial<Int, kDegree>& f, const Root<Int>& root, const Polynomial<Coefficient, 2>& g) {
  if (g.is_zero()) return 0;
  if (root.exact) return evaluate(g, dyadic_of<typename Coefficient::Dyadic>(root.floor)).sign();
  const int sign = sign_over_ulp(g, root.floor);
  if constexpr (Int::kUnbounded) {
    if (sign == kUnknownSign) return roots::tarski_query(f, g, root);
  }
  return sign;
}

}  // namespace warmfront

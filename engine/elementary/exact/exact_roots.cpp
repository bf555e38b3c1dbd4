// SPDX-License-Identifier: Apache-2.0
#include "engine/elementary/exact/exact_roots.h"

#include <vector>

namespace warmfront::roots {
namespace {

using Coefficients = std::vector<Big>;  // ascending powers, the last one not 0; empty: the polynomial 0

void normalise(Coefficients& p) {
  while (!p.empty() && p.back().sign() == 0) p.pop_back();
}

template <int kDegree>
Coefficients coefficients(const Polynomial<Big, kDegree>& p) {
  Coefficients all(p.c.begin(), p.c.end());
  normalise(all);
  return all;
}

// a mod b, times a positive number.
Coefficients remainder(Coefficients a, const Coefficients& b) {
  const int lead_sign = b.back().sign();
  const Big lead = lead_sign < 0 ? -b.back() : b.back();
  while (a.size() >= b.size()) {
    const std::size_t shift = a.size() - b.size();
    const Big top = lead_sign < 0 ? -a.back() : a.back();
    for (Big& x : a) x = x * lead;
    for (std::size_t i = 0; i < b.size(); ++i) a[i + shift] = a[i + shift] - top * b[i];
    a.pop_back();  // 0 by construction
    normalise(a);
  }
  return a;
}

int sign_of(const Coefficients& p, const BigDyadic& t) {
  Big value = p.back();
  const int degree = static_cast<int>(p.size()) - 1;
  for (int i = degree; i-- > 0;) value = value * t.numerator + (p[i] << ((degree - i) * t.shift));
  return value.sign();
}

// The Cauchy index of f' g / f over (begin, end) by Sturm: variations lost along the signed remainder
// sequence of f and f' g. Adding a multiple of f to the numerator keeps the index, so f' g is reduced first.
int query(const Coefficients& f, const Coefficients& g, const BigDyadic& begin, const BigDyadic& end) {
  Coefficients numerator(f.size() + g.size() - 2, Big(0));
  for (std::size_t i = 1; i < f.size(); ++i) {
    for (std::size_t j = 0; j < g.size(); ++j)
      numerator[i + j - 1] = numerator[i + j - 1] + f[i] * g[j] * static_cast<std::uint64_t>(i);
  }
  Coefficients before = f;
  Coefficients after = remainder(std::move(numerator), f);
  int begin_last = sign_of(f, begin);
  int end_last = sign_of(f, end);
  int lost = 0;
  while (!after.empty()) {
    const auto count = [&](const BigDyadic& t, int& last) {
      const int sign = sign_of(after, t);
      const int changed = sign * last < 0;
      if (sign != 0) last = sign;
      return changed;
    };
    lost += count(begin, begin_last) - count(end, end_last);
    Coefficients next = remainder(std::move(before), after);
    for (Big& x : next) x = -x;
    before = std::move(after);
    after = std::move(next);
  }
  return lost;
}

BigDyadic dyadic_quotient(const Big& numerator, const Big& denominator, int precision) {
  return {floor_divide(numerator, denominator), precision};
}

bool within_unit(const BigDyadic& t) {
  return t.numerator.sign() > 0 && (t.numerator - (Big(1) << t.shift)).sign() < 0;
}

template <int kDegree>
SplitPoints<Big, kDegree> those_within(const Polynomial<Big, kDegree>& f, std::array<BigDyadic, 2> candidates,
                                       int count) {
  if (count == 2 && (candidates[0].numerator - candidates[1].numerator).sign() > 0)
    std::swap(candidates[0], candidates[1]);
  SplitPoints<Big, kDegree> points;
  for (int i = 0; i < count; ++i) {
    if (within_unit(candidates[i]) && evaluate(f, candidates[i]).sign() != 0)
      points.at[points.count++] = std::move(candidates[i]);
  }
  return points;
}

}  // namespace

SplitPoints<Big, 2> split_points(const Polynomial<Big, 2>& f, int precision) {
  const Big two_c2 = f.c[2] + f.c[2];
  if (two_c2.sign() == 0) return {};
  return those_within<2>(f, {dyadic_quotient(-(f.c[1] << precision), two_c2, precision), {}}, 1);
}

SplitPoints<Big, 3> split_points(const Polynomial<Big, 3>& f, int precision) {
  const Big three_c3 = f.c[3] * std::uint64_t{3};
  if (three_c3.sign() == 0) {
    const Big two_c2 = f.c[2] + f.c[2];
    if (two_c2.sign() == 0) return {};
    return those_within<3>(f, {dyadic_quotient(-(f.c[1] << precision), two_c2, precision), {}}, 1);
  }
  // The roots of 3 c3 t^2 + 2 c2 t + c1; real, as f's three are.
  const Big discriminant = f.c[2] * f.c[2] - three_c3 * f.c[1];
  const Big root = floor_sqrt(discriminant << (2 * precision));
  const Big middle = -(f.c[2] << precision);
  return those_within<3>(f,
                         {dyadic_quotient(middle - root, three_c3, precision),
                          dyadic_quotient(middle + root, three_c3, precision)},
                         2);
}

LinearFactors linear_factors(const Polynomial<Big, 2>& f) {
  LinearFactors factors;
  factors.count = 1;
  factors.c[0] = {f.c[1], f.c[2] + f.c[2]};
  return factors;
}

LinearFactors linear_factors(const Polynomial<Big, 3>& f) {
  const auto& [d, c, b, a] = f.c;
  LinearFactors factors;
  if (a.sign() == 0) {
    factors.count = 1;
    factors.c[0] = {c, b + b};
    return factors;
  }
  const Big p = b * b - a * c * std::uint64_t{3};
  if (p.sign() == 0) {  // triple: -b / 3a
    factors.count = 1;
    factors.c[0] = {b, a * std::uint64_t{3}};
    return factors;
  }
  // Double: (9 a d - b c) / 2 p. Simple: (4 a b c - 9 a^2 d - b^3) / a p.
  factors.count = 2;
  factors.c[0] = {b * c - a * d * std::uint64_t{9}, p + p};
  factors.c[1] = {b * b * b + a * a * d * std::uint64_t{9} - a * b * c * std::uint64_t{4}, a * p};
  // Ascending: -x0 / x1 > -y0 / y1, times x1 y1.
  const auto& [x, y] = factors.c;
  const int order = (y[0] * x[1] - x[0] * y[1]).sign() * x[1].sign() * y[1].sign();
  if (order > 0) std::swap(factors.c[0], factors.c[1]);
  return factors;
}

int tarski_query(const Polynomial<Big, 3>& f, const Polynomial<Big, 2>& g, const Root<Big>& root) {
  return query(coefficients(f), coefficients(g), root.begin, root.end);
}
int tarski_query(const Polynomial<Big, 2>& f, const Polynomial<Big, 2>& g, const Root<Big>& root) {
  return query(coefficients(f), coefficients(g), root.begin, root.end);
}

}  // namespace warmfront::roots

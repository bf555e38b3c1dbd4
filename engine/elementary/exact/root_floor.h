// SPDX-License-Identifier: Apache-2.0
// The largest double not above the only root in an interval, of a polynomial of degree at most 3 with integer
// coefficients; Newton's step alone also of higher degree. Pure functions.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <optional>

#include "engine/elementary/exact/exact_polynomial.h"

namespace warmfront {

/// A root of f, the only one in (begin, end], and none at begin; f is not zero at `end` unless the root is.
template <class Int>
struct Root {
  typename Int::Dyadic begin;
  typename Int::Dyadic end;
  double floor;  ///< the largest double not above the root
  bool exact;    ///< the root is `floor`
};

namespace roots {

/// The greatest double not above the dyadic in [0, 1].
inline double floor_of(const SmallDyadic& t) {
  return std::ldexp(static_cast<double>(t.numerator), -t.shift);
}
inline double floor_of(const BigDyadic& t) {
  return t.numerator.floor_scaled(t.shift);
}

/// The coefficients in double, divided by a power of two so that the largest is in [1/2, 1).
template <int kDegree>
struct Approximation {
  std::array<double, kDegree + 1> c;
  int scale;

  template <class Int>
  explicit Approximation(const Polynomial<Int, kDegree>& f) : scale(0) {
    for (const Int& x : f.c) scale = std::max(scale, x.bits());
    for (int i = 0; i <= kDegree; ++i) c[i] = f.c[i].scaled(scale);
  }
  double at(double t) const {
    double value = c[kDegree];
    for (int i = kDegree; i-- > 0;) value = value * t + c[i];
    return value;
  }
  double slope(double t) const {
    double value = kDegree * c[kDegree];
    for (int i = kDegree - 1; i > 0; --i) value = value * t + i * c[i];
    return value;
  }
  /// A root of the approximation between `begin` and `end`; before it the sign is `sign`.
  double root(double begin, double end, int sign) const {
    double t = 0.5 * (begin + end);
    for (int i = 0; i < 100; ++i) {
      const double value = at(t);
      ((value > 0 ? 1 : -1) == sign ? begin : end) = t;
      double next = t - value / slope(t);
      if (!(next > begin && next < end)) next = 0.5 * (begin + end);
      if (std::fabs(next - t) <= 0x1p-53 * t) return next;
      t = next;
    }
    return t;
  }
};

/// The largest double not above f's root near t, from f(t) and f'(t), if certain. For an f with coefficients
/// of at most 1: `value` with a relative error below 2^-49 and an absolute error of `value_error`, `slope`
/// from coefficients within 2^-52. Error bound: README.md.
template <int kDegree = 3>
std::optional<double> floor_by_newton(double t, double value, double slope, double value_error = 0) {
  static_assert(kDegree <= 6);
  constexpr double kSlopeError = kDegree <= 3 ? 0x1p-48 : 0x1p-45;
  constexpr double kTwiceBend = kDegree <= 3 ? 16 : 140;
  const double step = value / slope;
  const double blur = value_error / std::fabs(slope);
  const double reach = std::fabs(step) + blur;
  const double relative = (kSlopeError + kTwiceBend * reach) / std::fabs(slope);
  if (!(relative < 0x1p-10 && reach <= 0.25 * t)) return {};
  const double nearest = t - step;
  const double above = (t - nearest) - step;  // the root - nearest; the first difference is exact
  const double margin = reach * (2 * relative + 0x1p-47) + 2 * blur;
  if (std::fabs(above) <= margin) return {};
  return above > 0 ? nearest : std::bit_cast<double>(std::bit_cast<std::uint64_t>(nearest) - 1);
}

/// floor_by_newton() at t, with f(t) in fixed point of 128 bits: the coefficients scaled by a power of two to
/// below 2^124, and Horner's rule rounded down to integers. Each of the three products errs by less than 1
/// and t <= 1 amplifies no error: f(t) is within 3 units, below 2^-122 of the largest allowed coefficient.
/// None for t below 2^-10, whose bits reach below 2^-62, for t outside (0, 1], and for coefficients that fill
/// the 128 bits.
inline std::optional<double> floor_in_fixed_point(const Polynomial<Fixed<2>, 3>& f, double t) {
  if (!(t >= 0x1p-10 && t <= 1)) return {};
  const auto numerator = static_cast<std::uint64_t>(t * 0x1p62);
  Fixed<2>::Whole all = 0;
  for (const Fixed<2>& c : f.c) all |= c.magnitude();
  const auto high = static_cast<std::uint64_t>(all >> 64);
  const int zeros =
      high != 0 ? std::countl_zero(high) : 64 + std::countl_zero(static_cast<std::uint64_t>(all));
  if (zeros < 4 || zeros == 128) return {};
  std::array<Fixed<2>::SignedWhole, 4> c;
  std::array<double, 4> rounded;  // in units of 2^124, within 2^-60
  for (int i = 0; i < 4; ++i) {
    c[i] = f.c[i].value() << (zeros - 4);
    rounded[i] = static_cast<double>(static_cast<std::int64_t>(c[i] >> 64)) * 0x1p-60;
  }
  Fixed<2>::SignedWhole value = c[3];
  for (int i = 3; i-- > 0;) {
    const auto upper = static_cast<Fixed<2>::SignedWhole>(static_cast<std::int64_t>(value >> 64)) *
                       static_cast<std::int64_t>(numerator);
    const auto lower = static_cast<Fixed<2>::Whole>(static_cast<std::uint64_t>(value)) * numerator;
    value = upper * 4 + static_cast<Fixed<2>::SignedWhole>(lower >> 62) + c[i];
  }
  const double slope = rounded[1] + t * (2 * rounded[2] + t * (3 * rounded[3]));
  return floor_by_newton(t, static_cast<double>(value) * 0x1p-124, slope, 0x1p-122);
}

/// The largest double not above the only root in (begin, end], by exact signs at doubles: at the guess (or
/// the floating-point root), at the Newton iterates, and then in doubling and finally halving steps:
/// typically 3 signs, at most 140. None where Fixed is too narrow for a double.
template <class Int, int kDegree>
std::optional<Root<Int>> locate(const Polynomial<Int, kDegree>& f, const typename Int::Dyadic& begin,
                                const typename Int::Dyadic& end, int sign_before, const double* guess) {
  using Dyadic = typename Int::Dyadic;
  // Doubles are ordered as their bits. The answer is in [low, high): f has sign_before at each double above
  // `begin` and below the root.
  const double begin_floor = floor_of(begin);
  const double end_floor = floor_of(end);
  auto low = std::bit_cast<std::uint64_t>(begin_floor);
  auto high = std::bit_cast<std::uint64_t>(end_floor) + 1;
  // The least double whose lowest bit Fixed can hold.
  constexpr std::uint64_t kLeast = Int::kUnbounded ? 0 : std::bit_cast<std::uint64_t>(0x1p-73);
  const Approximation<kDegree> approximation(f);

  double next = guess != nullptr ? *guess : approximation.root(begin_floor, end_floor, sign_before);
  std::uint64_t bits = next > 0 ? std::bit_cast<std::uint64_t>(next) : 0;
  std::uint64_t reach = 1;
  for (int newton = 6; high - low > 1;) {
    bits = std::max(std::clamp(bits, low + 1, high - 1), kLeast);
    if (bits >= high) return {};
    const double at = std::bit_cast<double>(bits);
    const Dyadic t = dyadic_of<Dyadic>(at);
    const auto value = evaluate(f, t);
    const int sign = value.sign();
    if (sign == 0) return Root<Int>{begin, end, at, true};
    const bool before = sign == sign_before;
    (before ? low : high) = bits;
    if (newton > 0) {
      --newton;
      const double approximate = value.scaled(kDegree * t.shift + approximation.scale);
      const double slope = approximation.slope(at);
      if constexpr (!Int::kUnbounded) {  // Big's values may underflow as doubles
        if (const auto floor = floor_by_newton<kDegree>(at, approximate, slope)) {
          const auto floor_bits = std::bit_cast<std::uint64_t>(*floor);
          if (floor_bits >= std::max(low, kLeast) && floor_bits + 1 < high)
            return Root<Int>{begin, end, *floor, false};
        }
      }
      next = at - approximate / slope;
      if (next > 0 && next <= 1) {
        const auto next_bits = std::bit_cast<std::uint64_t>(next);
        const std::uint64_t ulps = next_bits > bits ? next_bits - bits : bits - next_bits;
        if (ulps > 1) {
          bits = next_bits;
          continue;
        }
      }
      newton = 0;
    }
    const std::uint64_t step = std::min(reach, (high - low) / 2);
    bits = before ? low + step : high - step;
    reach = std::min(2 * reach, std::uint64_t{1} << 62);
  }
  return Root<Int>{begin, end, std::bit_cast<double>(low), false};
}

}  // namespace roots
}  // namespace warmfront

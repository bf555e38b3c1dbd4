// SPDX-License-Identifier: Apache-2.0
// Exponents and powers of two from a double's bits: std::frexp and std::ldexp are calls. Pure functions.
#pragma once

#include <bit>
#include <cmath>
#include <cstdint>

namespace warmfront {

/// The e for which x = m 2^e with m in [0.5, 1), as std::frexp() says; x is positive and finite.
inline int exponent_of(double x) {
  const auto biased = static_cast<int>(std::bit_cast<std::uint64_t>(x) >> 52);
  if (biased != 0) return biased - 1022;
  int exponent = 0;
  std::frexp(x, &exponent);  // denormal
  return exponent;
}

inline constexpr int kLeastPower = -1022, kMostPower = 1023;

/// 2^exponent, for kLeastPower to kMostPower.
inline double power_of_two(int exponent) {
  return std::bit_cast<double>(static_cast<std::uint64_t>(1023 + exponent) << 52);
}

}  // namespace warmfront

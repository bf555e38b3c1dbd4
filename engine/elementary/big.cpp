// SPDX-License-Identifier: Apache-2.0
#include "engine/elementary/big.h"

#include <cmath>

namespace warmfront {

double Big::scaled(int shift) const {
  long exponent = 0;
  const double mantissa = mpz_get_d_2exp(&exponent, value_);
  return std::ldexp(mantissa, static_cast<int>(exponent) - shift);
}

double Big::floor_scaled(int shift) const {
  // Cut to a multiple of 2^-1074 and to 53 bits, so that scaling is exact.
  if (shift > 1074) return (*this >> (shift - 1074)).floor_scaled(1074);
  long exponent = 0;
  const double mantissa = mpz_get_d_2exp(&exponent, value_);
  return std::ldexp(mantissa, static_cast<int>(exponent) - shift);
}

}  // namespace warmfront

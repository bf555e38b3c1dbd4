// SPDX-License-Identifier: Apache-2.0
// Integers of any size: GMP's arithmetic on our own limbs, with the interface of Fixed. As thread-safe as a
// vector; allocates and throws std::bad_alloc like one.
#pragma once

#include <gmp.h>

#include <cstdint>
#include <vector>

namespace warmfront {

struct BigDyadic;

/// GMP's integers (mpz_t) abort the process when memory runs out, and exceptions must not pass through C. So
/// only its functions on limbs (mpn_*) are used: they write to space that we provide, and use the stack for
/// temporaries of operands up to about a thousand limbs. The longest numbers here, from coordinates over all
/// of double's range, have about two thousand.
class Big {
 public:
  using Dyadic = BigDyadic;
  static constexpr int kMaxShift = 1 << 30;
  static constexpr bool kUnbounded = true;

  Big() = default;
  explicit Big(std::int64_t value);

  int sign() const { return limbs_.empty() ? 0 : negative_ ? -1 : 1; }
  template <int kDegree, int kWords = 2>
  const Big& room() const {
    return *this;
  }

  friend Big operator+(const Big& a, const Big& b) { return sum(a, b, b.negative_); }
  friend Big operator-(const Big& a, const Big& b) { return sum(a, b, !b.negative_); }
  /// Without an allocation where *this is the larger in magnitude and has space for a carry.
  Big& operator+=(const Big& b);
  Big operator-() const;
  friend Big operator*(const Big& a, const Big& b) { return product(a, b); }
  static Big product(const Big& a, const Big& b);
  friend Big operator*(const Big& a, std::uint64_t b) { return times(a, b); }
  friend Big operator<<(const Big& a, int bits) { return shifted_up(a, bits); }
  /// Rounds down.
  friend Big operator>>(const Big& a, int bits) { return shifted_down(a, bits); }
  /// Rounds down; b is not 0.
  friend Big floor_divide(const Big& a, const Big& b) { return quotient(a, b); }
  /// a / b, where b is not 0 and divides a.
  friend Big exact_quotient(const Big& a, const Big& b) { return exact(a, b); }
  /// The greatest odd common divisor of two numbers of at most kMostDivisorBits; of 0 and 0 it is 0.
  friend Big odd_divisor(const Big& a, const Big& b) { return divisor(a, b); }
  /// Numbers of which GMP finds common divisors without allocating.
  static constexpr int kMostDivisorBits = 256 * 64;
  /// Of a number >= 0.
  friend Big floor_sqrt(const Big& a) { return root(a); }

  /// Of the magnitude; 0 for 0.
  int bits() const;
  /// The exponent of the greatest power of two that divides it; not of 0.
  int trailing_zeros() const;
  /// The number mod m, in [0, m); m is above 2^63.
  std::uint64_t residue(std::uint64_t m) const;
  /// About value / 2^shift; infinity or 0 outside double's range.
  double scaled(int shift) const;
  /// The largest double not above value / 2^shift, which must be in [0, 1].
  double floor_scaled(int shift) const;

 private:
  static_assert(GMP_NUMB_BITS == 64);
  using Limbs = std::vector<mp_limb_t>;

  static Big sum(const Big& a, const Big& b, bool b_negative);
  static Big times(const Big& a, std::uint64_t b);
  static Big shifted_up(const Big& a, int bits);
  static Big shifted_down(const Big& a, int bits);
  static Big quotient(const Big& a, const Big& b);
  static Big root(const Big& a);
  static Big exact(const Big& a, const Big& b);
  static Big divisor(const Big& a, const Big& b);
  /// Takes the magnitude's leading zeros off.
  static Big of(Limbs limbs, bool negative);
  void add_one_to_magnitude();

  Limbs limbs_;  // of the magnitude, least significant first; the last one is not 0
  bool negative_ = false;
};

/// numerator / 2^shift.
struct BigDyadic {
  Big numerator;
  int shift;
};

}  // namespace warmfront

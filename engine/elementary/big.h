// SPDX-License-Identifier: Apache-2.0
// Integers of any size: GMP behind the same face as Fixed. A value as thread-safe as an int; it allocates.
#pragma once

#include <gmp.h>

#include <cstdint>
#include <utility>

namespace warmfront {

struct BigDyadic;

class Big {
 public:
  using Dyadic = BigDyadic;
  static constexpr int kMaxShift = 1 << 30;
  static constexpr bool kUnbounded = true;

  Big() { mpz_init(value_); }
  explicit Big(std::int64_t value) { mpz_init_set_si(value_, value); }
  Big(const Big& other) { mpz_init_set(value_, other.value_); }
  Big(Big&& other) noexcept {
    mpz_init(value_);
    mpz_swap(value_, other.value_);
  }
  Big& operator=(const Big& other) {
    mpz_set(value_, other.value_);
    return *this;
  }
  Big& operator=(Big&& other) noexcept {
    mpz_swap(value_, other.value_);
    return *this;
  }
  ~Big() { mpz_clear(value_); }

  int sign() const { return mpz_sgn(value_); }
  template <int kDegree, int kWords = 2>
  const Big& room() const {
    return *this;
  }

  friend Big operator+(const Big& a, const Big& b) {
    Big sum;
    mpz_add(sum.value_, a.value_, b.value_);
    return sum;
  }
  friend Big operator-(const Big& a, const Big& b) {
    Big difference;
    mpz_sub(difference.value_, a.value_, b.value_);
    return difference;
  }
  Big operator-() const {
    Big negated;
    mpz_neg(negated.value_, value_);
    return negated;
  }
  friend Big operator*(const Big& a, const Big& b) {
    Big product;
    mpz_mul(product.value_, a.value_, b.value_);
    return product;
  }
  static Big product(const Big& a, const Big& b) { return a * b; }
  friend Big operator*(const Big& a, std::uint64_t b) {
    Big product;
    mpz_mul_ui(product.value_, a.value_, b);
    return product;
  }
  friend Big operator<<(const Big& a, int bits) {
    Big shifted;
    mpz_mul_2exp(shifted.value_, a.value_, static_cast<mp_bitcnt_t>(bits));
    return shifted;
  }
  /// Rounds down.
  friend Big operator>>(const Big& a, int bits) {
    Big shifted;
    mpz_fdiv_q_2exp(shifted.value_, a.value_, static_cast<mp_bitcnt_t>(bits));
    return shifted;
  }
  /// Rounds down.
  friend Big floor_divide(const Big& a, const Big& b) {
    Big quotient;
    mpz_fdiv_q(quotient.value_, a.value_, b.value_);
    return quotient;
  }
  friend Big floor_sqrt(const Big& a) {
    Big root;
    mpz_sqrt(root.value_, a.value_);
    return root;
  }

  int bits() const { return sign() == 0 ? 0 : static_cast<int>(mpz_sizeinbase(value_, 2)); }
  /// About value / 2^shift; what leaves double's range is infinite or 0.
  double scaled(int shift) const;
  /// The largest double not above value / 2^shift, of a value >= 0 where that is at most 1.
  double floor_scaled(int shift) const;

 private:
  mpz_t value_;
};

/// numerator / 2^shift.
struct BigDyadic {
  Big numerator;
  int shift;
};

}  // namespace warmfront

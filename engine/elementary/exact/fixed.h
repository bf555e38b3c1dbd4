// SPDX-License-Identifier: Apache-2.0
// Integers of a fixed number of 64-bit limbs on the stack: exact arithmetic without allocation, for
// elementary tests whose coordinates span few enough bits. Values and pure functions. Products widen the
// type; for sums, the caller must prove that the result fits.
#pragma once

#include <array>
#include <bit>
#include <cstdint>

namespace warmfront {

/// A double in [0, 1] as numerator / 2^shift, the numerator below 2^54.
struct SmallDyadic {
  std::uint64_t numerator;
  int shift;
};

/// A signed integer of kLimbs limbs, two's complement, least limb first.
template <int kLimbs>
class Fixed {
 public:
  using Dyadic = SmallDyadic;
  /// The largest shift of a Dyadic that fits evaluate().
  static constexpr int kMaxShift = 125;
  static constexpr bool kUnbounded = false;
  static constexpr int kWidth = kLimbs;

  Fixed() = default;
  explicit Fixed(std::int64_t value) {
    limb_[0] = static_cast<std::uint64_t>(value);
    for (int i = 1; i < kLimbs; ++i) limb_[i] = value < 0 ? ~std::uint64_t{0} : 0;
  }

  int sign() const {
    if (negative()) return -1;
    std::uint64_t any = 0;
    for (const std::uint64_t limb : limb_) any |= limb;
    return any != 0 ? 1 : 0;
  }

  template <int kMore>
  Fixed<kMore> widened() const {
    static_assert(kMore >= kLimbs);
    Fixed<kMore> wide;
    for (int i = 0; i < kLimbs; ++i) wide.limb_[i] = limb_[i];
    for (int i = kLimbs; i < kMore; ++i) wide.limb_[i] = extension();
    return wide;
  }

  /// Wide enough for evaluate() at degree kDegree, for shifts up to 63 kWords - 1: kWords limbs per degree.
  template <int kDegree, int kWords = 2>
  auto room() const {
    return widened<kLimbs + kWords * kDegree>();
  }

  friend Fixed operator+(const Fixed& a, const Fixed& b) {
    if constexpr (kLimbs == 2) return of(a.whole() + b.whole());
    Fixed sum;
    unsigned char carry = 0;
    for (int i = 0; i < kLimbs; ++i) {
      const Double s = Double{a.limb_[i]} + b.limb_[i] + carry;
      sum.limb_[i] = static_cast<std::uint64_t>(s);
      carry = static_cast<unsigned char>(s >> 64);
    }
    return sum;
  }
  friend Fixed operator-(const Fixed& a, const Fixed& b) {
    if constexpr (kLimbs == 2) return of(a.whole() - b.whole());
    Fixed difference;
    unsigned char borrow = 0;
    for (int i = 0; i < kLimbs; ++i) {
      const Double d = Double{a.limb_[i]} - b.limb_[i] - borrow;
      difference.limb_[i] = static_cast<std::uint64_t>(d);
      borrow = static_cast<unsigned char>(d >> 64) & 1;
    }
    return difference;
  }
  Fixed operator-() const { return Fixed(0) - *this; }

  /// The sum of both widths: always exact.
  template <int kOther>
  Fixed<kLimbs + kOther> operator*(const Fixed<kOther>& b) const {
    if constexpr (kLimbs == 1 && kOther == 1) {
      return Fixed<2>::of(static_cast<Double>(SignedDouble{static_cast<std::int64_t>(limb_[0])} *
                                              static_cast<std::int64_t>(b.limb_[0])));
    }
    Fixed<kLimbs + kOther> product(0);
    for (int i = 0; i < kLimbs; ++i) {
      std::uint64_t carry = 0;
      for (int j = 0; j < kOther; ++j) {
        const Double p = Double{limb_[i]} * b.limb_[j] + product.limb_[i + j] + carry;
        product.limb_[i + j] = static_cast<std::uint64_t>(p);
        carry = static_cast<std::uint64_t>(p >> 64);
      }
      product.limb_[i + kOther] = carry;
    }
    // A negative factor was read as itself + 2^(64 limbs).
    product.subtract_at(kLimbs, b, extension());
    product.subtract_at(kOther, *this, b.extension());
    return product;
  }

  /// a * b, which the caller has proved to fit.
  template <int kA, int kB>
  static Fixed product(const Fixed<kA>& a, const Fixed<kB>& b) {
    if constexpr (kLimbs == 2) {
      return of(a.template widened<2>().whole() * b.template widened<2>().whole());
    } else {
      return a * b;
    }
  }

  /// Products that the caller has proved to fit.
  friend Fixed operator*(const Fixed& a, std::uint64_t b) {
    Fixed product;
    std::uint64_t carry = 0;
    for (int i = 0; i < kLimbs; ++i) {
      const Double p = Double{a.limb_[i]} * b + carry;
      product.limb_[i] = static_cast<std::uint64_t>(p);
      carry = static_cast<std::uint64_t>(p >> 64);
    }
    return product;
  }
  friend Fixed operator<<(const Fixed& a, int bits) {
    Fixed shifted(0);
    const int limbs = bits / 64;
    const int rest = bits % 64;
    for (int i = limbs; i < kLimbs; ++i) {
      shifted.limb_[i] = a.limb_[i - limbs] << rest;
      if (rest != 0 && i > limbs) shifted.limb_[i] |= a.limb_[i - limbs - 1] >> (64 - rest);
    }
    return shifted;
  }

  /// The value and its magnitude as built-in integers, where this width has one.
  __extension__ using Whole = unsigned __int128;
  __extension__ using SignedWhole = __int128;
  SignedWhole value() const {
    static_assert(kLimbs == 2);
    return static_cast<SignedWhole>(whole());
  }
  Whole magnitude() const { return negative() ? -whole() : whole(); }

  /// Bits of the magnitude; 0 for 0.
  int bits() const {
    const Fixed magnitude = negative() ? -*this : *this;
    for (int i = kLimbs; i-- > 0;) {
      if (magnitude.limb_[i] != 0) return 64 * i + 64 - std::countl_zero(magnitude.limb_[i]);
    }
    return 0;
  }

  /// About value / 2^shift, relative 2^-52, within double's normal range; limbs that contribute less than
  /// 2^-1000 are dropped.
  double scaled(int shift) const {
    const Fixed magnitude = negative() ? -*this : *this;
    double sum = 0;
    for (int i = 0; i < kLimbs; ++i) {
      const int exponent = 64 * i - shift;
      if (exponent < -1000 || magnitude.limb_[i] == 0) continue;
      sum += static_cast<double>(magnitude.limb_[i]) *
             std::bit_cast<double>(static_cast<std::uint64_t>(1023 + exponent) << 52);
    }
    return negative() ? -sum : sum;
  }

 private:
  template <int>
  friend class Fixed;
  using Double = Whole;
  using SignedDouble = SignedWhole;

  Double whole() const { return Double{limb_[1]} << 64 | limb_[0]; }
  static Fixed of(Double whole) {
    Fixed value;
    value.limb_ = {static_cast<std::uint64_t>(whole), static_cast<std::uint64_t>(whole >> 64)};
    return value;
  }

  bool negative() const { return (limb_[kLimbs - 1] >> 63) != 0; }
  std::uint64_t extension() const { return negative() ? ~std::uint64_t{0} : 0; }

  template <int kOther>
  void subtract_at(int first, const Fixed<kOther>& b, std::uint64_t mask) {
    unsigned char borrow = 0;
    for (int i = 0; i < kOther; ++i) {
      const Double d = Double{limb_[first + i]} - (b.limb_[i] & mask) - borrow;
      limb_[first + i] = static_cast<std::uint64_t>(d);
      borrow = static_cast<unsigned char>(d >> 64) & 1;
    }
  }

  std::array<std::uint64_t, kLimbs> limb_;
};

}  // namespace warmfront

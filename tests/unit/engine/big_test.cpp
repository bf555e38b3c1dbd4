// SPDX-License-Identifier: Apache-2.0
// Integers of any size: every operation against GMP's own integers, at lengths from none to those from
// operands over all of double's range.
#include "engine/elementary/exact/big.h"

#include <gmpxx.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace warmfront {
namespace {

struct Both {
  Big big;
  mpz_class right;
};

Big big_of(const mpz_class& value) {
  Big big;
  mpz_class rest = abs(value);
  for (int shift = 0; rest != 0; shift += 32) {
    big = big + (Big(static_cast<std::int64_t>(mpz_class(rest & 0xffffffffUL).get_ui())) << shift);
    rest >>= 32;
  }
  return value < 0 ? -big : big;
}

void expect_equal(const Big& big, const mpz_class& right) {
  ASSERT_EQ(big.sign(), sgn(right));
  ASSERT_EQ(big.bits(), right == 0 ? 0 : static_cast<int>(mpz_sizeinbase(right.get_mpz_t(), 2)));
  ASSERT_EQ((big - big_of(right)).sign(), 0);
}

// Short and long, with long rows of equal bits, so that carries run.
Both draw(gmp_randclass& bits, std::mt19937_64& random) {
  const std::array<unsigned, 6> lengths{0, 20, 64, 200, 3'000, 80'000};
  mpz_class value = bits.get_z_bits(lengths[random() % lengths.size()]);
  if (random() % 3 == 0) value = (value << (random() % 200)) - 1;
  if (random() % 3 == 0) value = mpz_class(1) << (random() % 300);
  if (random() % 2 == 0) value = -value;
  return {big_of(value), value};
}

TEST(Big, ComputesAsGmpsIntegersDo) {
  gmp_randclass bits(gmp_randinit_default);
  bits.seed(3);
  std::mt19937_64 random(3);
  for (int trial = 0; trial < 400; ++trial) {
    const Both a = draw(bits, random);
    const Both b = draw(bits, random);
    const int shift = static_cast<int>(random() % 300);
    const std::uint64_t small = random() >> (random() % 64);
    expect_equal(a.big, a.right);
    expect_equal(-a.big, -a.right);
    expect_equal(a.big + b.big, a.right + b.right);
    expect_equal(a.big - b.big, a.right - b.right);
    expect_equal(a.big - a.big, 0);
    expect_equal(a.big * b.big, a.right * b.right);
    expect_equal(a.big * small, a.right * mpz_class(static_cast<unsigned long>(small)));
    mpz_class moved = a.right << shift;
    expect_equal(a.big << shift, moved);
    mpz_fdiv_q_2exp(moved.get_mpz_t(), a.right.get_mpz_t(), static_cast<mp_bitcnt_t>(shift));
    expect_equal(a.big >> shift, moved);
    if (b.right != 0) {
      mpz_class quotient;
      mpz_fdiv_q(quotient.get_mpz_t(), a.right.get_mpz_t(), b.right.get_mpz_t());
      expect_equal(floor_divide(a.big, b.big), quotient);
    }
    expect_equal(floor_sqrt(a.right < 0 ? -a.big : a.big), sqrt(abs(a.right)));
    long exponent = 0;
    const double mantissa = mpz_get_d_2exp(&exponent, a.right.get_mpz_t());
    ASSERT_EQ(a.big.scaled(shift), std::ldexp(mantissa, static_cast<int>(exponent) - shift));
  }
}

TEST(Big, TakesTheLeastAndTheGreatestWord) {
  for (const std::int64_t value : {INT64_MIN, INT64_MIN + 1, std::int64_t{-1}, std::int64_t{0}, INT64_MAX})
    expect_equal(Big(value), mpz_class(static_cast<long>(value)));
}

TEST(Big, FloorsToDoubles) {
  const Big third = floor_divide(Big(1) << 200, Big(3));
  EXPECT_EQ(third.floor_scaled(200), 1.0 / 3);  // the nearest double is below
  const Big fifth = floor_divide(Big(1) << 200, Big(5));
  EXPECT_EQ(fifth.floor_scaled(200), std::nextafter(0.2, 0.0));
  EXPECT_EQ(Big(3).floor_scaled(1075), 0x1p-1074);
  EXPECT_EQ(Big(1).floor_scaled(1075), 0);
}

}  // namespace
}  // namespace warmfront

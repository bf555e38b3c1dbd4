// SPDX-License-Identifier: Apache-2.0
// What the oracle is based on: polynomials made from known roots.
#include "tests/support/polynomial.h"

#include <gtest/gtest.h>

#include <random>

namespace warmfront::testing {
namespace {

// den x - num.
Polynomial linear(long num, long den) {
  return Polynomial({mpz_class(-num), mpz_class(den)});
}

TEST(Polynomial, DyadicsAreTheDoubles) {
  for (const double x : {0.0, 1.0, -0.75, 0x1p-1074, -0x1.fffffffffffffp1023, 0x1.8p60}) {
    const Dyadic d = dyadic(x);
    EXPECT_EQ(mpq_class(d.numerator, mpz_class(1) << d.exponent).get_d(), x);
    EXPECT_EQ(compare(d, dyadic(x)), 0);
    EXPECT_EQ(compare(midpoint(d, dyadic(-x)), dyadic(0)), 0);
  }
  EXPECT_LT(compare(dyadic(0x1p-1074), dyadic(0x1p-1073)), 0);
}

TEST(Polynomial, AnEmptyRemainderIsADivisor) {
  const Polynomial a = linear(1, 3) * linear(2, 7);
  const Polynomial b = linear(-5, 2) * linear(2, 7);
  EXPECT_TRUE(remainder(a, linear(1, 3)).is_zero());
  EXPECT_EQ(gcd(a, b).degree(), 1);
  EXPECT_TRUE(remainder(a, gcd(a, b)).is_zero());
  EXPECT_EQ(squarefree(a * a * b).degree(), 3);
  EXPECT_EQ(quotient(a * b, b).degree(), 2);
  EXPECT_TRUE(remainder(a, quotient(a * b, b)).is_zero());
}

// Products of random linear factors, repeated now and then, times a quadratic without real roots.
TEST(Polynomial, FindsTheRootsItWasMadeOf) {
  std::mt19937_64 random(3);
  for (int trial = 0; trial < 300; ++trial) {
    Polynomial p({mpz_class(1 + random() % 5), mpz_class(1), mpz_class(3)});
    std::vector<mpq_class> inside;
    for (int k = static_cast<int>(random() % 5); k >= 0; --k) {
      const long den = 1 + static_cast<long>(random() % 12);
      const long num = static_cast<long>(random() % 30) - 8;
      const mpq_class root(num, den);
      for (int repeat = random() % 4 == 0 ? 2 : 1; repeat > 0; --repeat) p = p * linear(num, den);
      if (root > 0 && root <= 1) inside.push_back(root);
    }
    std::ranges::for_each(inside, [](mpq_class& q) { q.canonicalize(); });
    std::ranges::sort(inside);
    inside.erase(std::unique(inside.begin(), inside.end()), inside.end());
    std::vector<Root> roots = roots_in_unit_interval(p);
    ASSERT_EQ(roots.size(), inside.size()) << trial;
    EXPECT_EQ(count_roots(p, {0, 0}, {1, 0}), static_cast<int>(inside.size()));
    for (std::size_t k = 0; k < roots.size(); ++k) {
      const Polynomial own = linear(inside[k].get_num().get_si(), inside[k].get_den().get_si());
      EXPECT_EQ(sign_at(own, roots[k]), 0) << trial;
      EXPECT_EQ(sign_at(own + Polynomial({mpz_class(1)}), roots[k]), 1) << trial;
      EXPECT_EQ(sign_at(own * own * linear(2, 1), roots[k]), 0) << trial;
      for (std::size_t l = 0; l < roots.size(); ++l) {
        EXPECT_EQ(compare(roots[k], roots[l]) < 0, k < l) << trial;
        EXPECT_EQ(compare(roots[k], roots[l]) == 0, k == l) << trial;
      }
      Root same = roots_in_unit_interval(own).front();
      EXPECT_EQ(compare(same, roots[k]), 0) << trial;
    }
  }
}

// Irrational roots, closer together than doubles can resolve.
TEST(Polynomial, TellsCloseIrrationalRootsApart) {
  // 2 x^2 = 1, and 2 x^2 = 1 + 2^-200.
  const mpz_class big = mpz_class(1) << 200;
  const Polynomial a({mpz_class(-1), 0, mpz_class(2)});
  const Polynomial b({-big - 1, 0, 2 * big});
  std::vector<Root> roots = roots_in_unit_interval(a * b);
  ASSERT_EQ(roots.size(), 2U);
  EXPECT_EQ(sign_at(a, roots[0]), 0);
  EXPECT_EQ(sign_at(b, roots[0]), -1);
  EXPECT_EQ(sign_at(a, roots[1]), 1);
  EXPECT_EQ(sign_at(b, roots[1]), 0);
  EXPECT_EQ(compare(dyadic(0x1.6a09e667f3bccp-1), roots[0]), -1);
  EXPECT_EQ(compare(dyadic(0x1.6a09e667f3bcdp-1), roots[1]), 1);
}

}  // namespace
}  // namespace warmfront::testing

// SPDX-License-Identifier: Apache-2.0
// Common divisors of long polynomials, which must not be longer than they need be: what is computed with them
// next would take minutes.
#include "engine/elementary/exact/common_divisor.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <random>

#include "engine/elementary/exact_near.h"
#include "tests/support/near_oracle.h"

namespace warmfront {
namespace {

using roots::Coefficients;

class LongNumbers : public ::testing::Test {
 protected:
  Big drawn(int bits) {
    Big x(0);
    for (int at = 0; at < bits; at += 32) x = (x << 32) + Big(static_cast<std::int64_t>(random_() >> 32));
    return random_() % 2 == 0 ? x : -x;
  }
  Coefficients polynomial(int degree, int bits) {
    Coefficients p;
    for (int i = 0; i <= degree; ++i) p.push_back(drawn(bits));
    return p;
  }
  static Coefficients product(const Coefficients& p, const Coefficients& q) {
    Coefficients all(p.size() + q.size() - 1, Big(0));
    for (std::size_t i = 0; i < p.size(); ++i)
      for (std::size_t k = 0; k < q.size(); ++k) all[i + k] = all[i + k] + p[i] * q[k];
    return all;
  }
  static int bits(const Coefficients& p) {
    int most = 0;
    for (const Big& x : p) most = std::max(most, x.bits());
    return most;
  }
  // Is one a multiple of the other by a number?
  static bool alike(const Coefficients& p, const Coefficients& q) {
    if (p.size() != q.size()) return false;
    for (std::size_t i = 0; i < p.size(); ++i)
      if ((p[i] * q.back() - q[i] * p.back()).sign() != 0) return false;
    return true;
  }

  std::mt19937_64 random_{11};
};

TEST_F(LongNumbers, HaveCommonDivisorsThatAreNoLonger) {
  for (const int length : {64, 900, 4000, 20000}) {
    for (const int of_common : {1, 2}) {
      const Coefficients common = polynomial(of_common, length);
      const Coefficients p = product(common, polynomial(4, length)),
                         q = product(common, polynomial(3, length));
      const Coefficients found = roots::common_divisor(p, q);
      EXPECT_TRUE(alike(found, common));
      EXPECT_LE(bits(found), 3 * (length + 64));
    }
  }
}

TEST_F(LongNumbers, KeepTheirRootsOnceEach) {
  for (const int length : {64, 900, 4000, 20000}) {
    const Coefficients twice = polynomial(1, length), once = polynomial(3, length);
    const Coefficients f = roots::squarefree(product(product(twice, twice), once));
    EXPECT_TRUE(alike(f, product(twice, once)));
    EXPECT_LE(bits(f), 4 * (length + 64));
  }
}

// Two edges whose coordinates are of all sizes and some of them equal: a step with this pair took a minute,
// and could not be cancelled meanwhile.
TEST_F(LongNumbers, OfAPairWithEqualCoordinates) {
  constexpr double z = 0x1p+1020, k = 0x1p+367, least = 0x1p-784;
  using Point = std::array<double, 4>;
  const std::array<VertexMotion, 4> vertices{
      VertexMotion{.t0 = Point{0x1p-412, -z, -z, 0}, .t1 = Point{-k, z, least, 0}},
      VertexMotion{.t0 = Point{z, 0x1p-537, z, 0}, .t1 = Point{-k, z, least, 0}},
      VertexMotion{.t0 = Point{0x1p-60, -0x1p+794, 0x1p-444, 0}, .t1 = Point{z, -0x1p+794, -z, 0}},
      VertexMotion{.t0 = Point{z, 0x1p+324, z, 0}, .t1 = Point{0x1p-372, 0x1p+3, z, 0}}};
  const FeatureVertices pair{ContactKind::kEdgeEdge,
                             {vertices.data(), &vertices[1], &vertices[2], &vertices[3]}};
  constexpr double separation = 0x1p+279;
  std::uint64_t exact_tests = 0;
  const Verdict verdict = exact_near_test(pair, separation, 1, exact_tests);
  const testing::ExactTruth truth = testing::near_truth(pair, separation);
  EXPECT_EQ(verdict.contact, truth.contact);
  EXPECT_EQ(verdict.toi, truth.toi);
  EXPECT_TRUE(truth.contact);
  EXPECT_EQ(exact_tests, 1U);
}

}  // namespace
}  // namespace warmfront

// SPDX-License-Identifier: Apache-2.0
// The shortcuts within the elementary tests, each held to what it stands for: signs at one time to signs over
// a window, the root found in fixed point to the one that exact signs find.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "engine/elementary/exact_polygon.h"
#include "engine/elementary/exact_roots.h"
#include "engine/elementary/inside.h"
#include "tests/support/feature_case.h"

namespace warmfront {
namespace {

using testing::FeatureCase;
using testing::Points;

// Multiples of 2^-20 in [-1, 1]: the coordinates span 21 bits, as a scene's in single precision do.
Points on_grid(std::mt19937_64& random) {
  std::uniform_int_distribution<int> coordinate(-(1 << 20), 1 << 20);
  Points points;
  for (auto& point : points)
    for (double& x : point) x = std::ldexp(coordinate(random), -20);
  return points;
}

constexpr ContactKind kKinds[] = {ContactKind::kVertexFace, ContactKind::kEdgeEdge};

TEST(ElementaryStages, SignsAtATimeHoldOverTheReach) {
  std::mt19937_64 random(20);
  int certain = 0;
  for (int i = 0; i < 20000; ++i) {
    const FeatureCase pair(kKinds[i % 2], on_grid(random), on_grid(random));
    const Query query = Query::prepare(pair.features(), 0);
    const double t = std::uniform_real_distribution<double>(0, 1)(random);
    const double reach = std::ldexp(1.0, -std::uniform_int_distribution<int>(8, 50)(random));
    const Inside around = inside_around(query, t, reach);
    if (around == Inside::kUnknown) continue;
    ++certain;
    // At every time of the reach the exact signs agree: strictly inside, or outside for one condition.
    for (const double at : {std::max(0.0, t - reach), t, std::min(1.0, t + reach)})
      EXPECT_EQ(inside(query, {at, at}), around) << i << " at " << at;
  }
  EXPECT_GT(certain, 10000);
}

TEST(ElementaryStages, SignsAtATimeAreUnknownWhereTheReachIsWide) {
  std::mt19937_64 random(21);
  for (int i = 0; i < 1000; ++i) {
    const FeatureCase pair(kKinds[i % 2], on_grid(random), on_grid(random));
    EXPECT_EQ(inside_around(Query::prepare(pair.features(), 0), 0.5, 0.5), Inside::kUnknown);
  }
}

TEST(ElementaryStages, RootsInFixedPointAreThoseOfExactSigns) {
  std::mt19937_64 random(22);
  int found = 0;
  int roots_in_all = 0;
  for (int i = 0; i < 20000; ++i) {
    const FeatureCase pair(kKinds[i % 2], on_grid(random), on_grid(random));
    const CoordinateBits bits(pair.features());
    ASSERT_TRUE(NarrowWidth::fits(bits));
    const auto f = DifferencePolygon<NarrowWidth>(pair.features(), bits).volume();
    visit_roots(f, [&](const auto& factor, const auto& root) {
      ++roots_in_all;
      // From guesses as good as double arithmetic's, and from worse ones.
      const double ulps = std::ldexp(std::uniform_real_distribution<double>(-1, 1)(random), i % 24);
      const double guess = std::clamp(root.floor * (1 + ulps * 0x1p-52), 0.0, 1.0);
      if (const auto floor = roots::floor_in_fixed_point(factor, guess)) {
        ++found;
        EXPECT_EQ(*floor, root.floor) << i;
      }
      return Answer::kNo;
    });
  }
  EXPECT_GT(roots_in_all, 10000);
  EXPECT_GT(found, roots_in_all * 8 / 10);
}

TEST(ElementaryStages, RootsInFixedPointAreNotClaimedWhereTheyAreDoubles) {
  // (2 t - 1) and (4 t - 1) (t + 1): which double is the greatest not above the root hangs on the last bit.
  const auto cubic = [](std::int64_t c0, std::int64_t c1, std::int64_t c2, std::int64_t c3) {
    return Polynomial<Fixed<2>, 3>{{Fixed<2>(c0), Fixed<2>(c1), Fixed<2>(c2), Fixed<2>(c3)}};
  };
  for (const double t : {0.5, std::nextafter(0.5, 0.0), std::nextafter(0.5, 1.0)})
    EXPECT_FALSE(roots::floor_in_fixed_point(cubic(-1, 2, 0, 0), t)) << t;
  EXPECT_FALSE(roots::floor_in_fixed_point(cubic(-1, 3, 4, 0), 0.25));
  // A third: the double nearest to it is below it.
  EXPECT_EQ(roots::floor_in_fixed_point(cubic(-1, 3, 0, 0), 0.3333333333), 1.0 / 3);
  // No slope, no polynomial, no room.
  EXPECT_FALSE(roots::floor_in_fixed_point(cubic(-1, 6, -12, 8), 0.5));
  EXPECT_FALSE(roots::floor_in_fixed_point(cubic(0, 0, 0, 0), 0.5));
  EXPECT_FALSE(roots::floor_in_fixed_point(cubic(-1, 3, 0, 0), 0x1p-11));
}

}  // namespace
}  // namespace warmfront

// SPDX-License-Identifier: Apache-2.0
// The shortcuts within the elementary tests, each against its definition: signs at one time against signs
// over a window, the root found in fixed point against the one found by exact signs, separating directions in
// lanes against exact algebra.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "engine/elementary/certified.h"
#include "engine/elementary/exact.h"
#include "engine/elementary/exact/exact_roots.h"
#include "engine/elementary/exact_polygon.h"
#include "engine/elementary/inside.h"
#include "engine/narrow_phase/feature_block.h"
#include "engine/narrow_phase/separation_filter.h"
#include "engine/pair_test.h"
#include "tests/support/exact_oracle.h"
#include "tests/support/feature_case.h"
#include "tests/support/torture.h"

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

bool kept_by_directions(const FeatureCase& query) {
  const FeaturePair pair{{0, 1, 2, 3}, 0, 0, query.kind};
  std::uint16_t survivor = 0;
  return separation_filter({&pair, 1}, query.vertices, &survivor, 1) == 1;
}

bool meets(const FeatureCase& query) {
  std::uint64_t exact_tests = 0;
  return exact_test(query.features(), 1, exact_tests).contact;
}

// Edges that part from where their ends are a unit in the last place apart: certified cannot tell that they
// do not meet there. A filter is part of a step's answer, and such an answer is the better one.
TEST(ElementaryStages, TheSeparationFilterMayKnowMoreThanCertified) {
  const Points t0{{{0x1.f3b5b2ae2ea31p+9, 0x1.f47504e242577p+9, 0x1.f33cee42f95cap+9},
                   {0x1.f350ceefc7a7p+9, 0x1.f3b8e5fc3c7d9p+9, 0x1.f3e3fe6d6fce2p+9},
                   {0x1.f350ceefc7a7p+9, 0x1.f3b8e5fc3c7d8p+9, 0x1.f3e3fe6d6fce2p+9},
                   {0x1.f35bbe01d9988p+9, 0x1.f40ebcc27517dp+9, 0x1.f3b0813a07c11p+9}}};
  const Points t1{{{0x1.f3ad0ad8fc195p+9, 0x1.f479c6c3fc30cp+9, 0x1.f336d58305765p+9},
                   {0x1.f357fd6d3708cp+9, 0x1.f3a7180665d99p+9, 0x1.f3e650d791d76p+9},
                   {0x1.f34db88637408p+9, 0x1.f3cad1424a093p+9, 0x1.f3e2192957172p+9},
                   {0x1.f357a81b7c406p+9, 0x1.f40cf988024e1p+9, 0x1.f3b5428e25842p+9}}};
  const FeatureCase edges(ContactKind::kEdgeEdge, t0, t1);
  EXPECT_EQ(certified_test(edges.features(), {}).status, ContactStatus::kOverlapAtStart);
  EXPECT_FALSE(meets(edges));
  EXPECT_FALSE(kept_by_directions(edges));
  const auto step = test_pair({ContactKind::kEdgeEdge, t0, t1}, {.tier = Tier::kCertified});
  EXPECT_FALSE(step.value().has_value());
}

// Primitives that touch at t = 1/2, in passing by: a vertex at the middle of a face's edge, or the middle of
// an edge at the end of another; all coordinates exact. They move by a translation, or turn too.
FeatureCase passing(std::mt19937_64& random, ContactKind kind, bool turning) {
  Points t0 = on_grid(random);
  Points t1 = on_grid(random);
  if (!turning) {
    for (int k = 1; k < 4; ++k)
      for (int axis = 0; axis < 3; ++axis) t1[k][axis] = t0[k][axis];
  }
  // Vertex 0 at the middle of edge 1 2; or vertex 2 at the middle of edge 0 1.
  const int moved = kind == ContactKind::kVertexFace ? 0 : 2;
  const int a = kind == ContactKind::kVertexFace ? 1 : 0;
  const int b = kind == ContactKind::kVertexFace ? 2 : 1;
  for (int axis = 0; axis < 3; ++axis) {
    const double middle = (t0[a][axis] + t1[a][axis] + t0[b][axis] + t1[b][axis]) / 4;
    t0[moved][axis] = 2 * middle - t1[moved][axis];
  }
  return FeatureCase(kind, t0, t1);
}

TEST(ElementaryStages, DirectionsSeparateNothingThatTouches) {
  std::mt19937_64 random(23);
  for (int i = 0; i < 20000; ++i) {
    const FeatureCase pair = passing(random, kKinds[i % 2], i % 4 < 2);
    EXPECT_TRUE(kept_by_directions(pair)) << testing::to_text(pair);
  }
}

TEST(ElementaryStages, DirectionsSeparateOnlyWhatExactAlgebraSeparates) {
  std::mt19937_64 random(24);
  int parted = 0;
  int touching = 0;
  for (int i = 0; i < 20000; ++i) {
    FeatureCase pair = passing(random, kKinds[i % 2], i % 4 < 2);
    // Off by some roundings, or by much more.
    double& nudged = pair.vertices[i % 2 == 0 ? 0 : 2].t1[i % 3];
    nudged += std::ldexp(std::uniform_real_distribution<double>(-1, 1)(random), -50 + i % 50);
    const bool meeting = meets(pair);
    touching += meeting;
    if (kept_by_directions(pair)) continue;
    ++parted;
    EXPECT_FALSE(meeting) << testing::to_text(pair);
  }
  EXPECT_GT(touching, 4000);
  EXPECT_GT(parted, 1000);
}

TEST(ElementaryStages, DirectionsSeparateOnlyWhatTheOracleSeparatesAtTheExtremes) {
  std::mt19937_64 random(25);
  int parted = 0;
  for (const testing::TortureFamily& family : testing::torture_families()) {
    for (int i = 0; i < 200; ++i) {
      const FeatureCase pair = family.make(random, kKinds[i % 2]);
      if (kept_by_directions(pair)) continue;
      ++parted;
      EXPECT_FALSE(testing::exact_truth(pair.features()).contact)
          << family.name << " " << testing::to_text(pair);
    }
  }
  EXPECT_GT(parted, 100);
}

TEST(ElementaryStages, DirectionsSeparatePrimitivesThatPassEachOtherFast) {
  // Seen along the motion the vertex is beside the triangle, although their swept boxes overlap.
  const Points start{{{-8, 0.625, -8}, {0, 0, 0}, {1, 0, 0}, {0, 1, 0}}};
  const Points beside = testing::moved(start, 0, 16, 0, 16);
  EXPECT_FALSE(kept_by_directions(
      {ContactKind::kVertexFace, testing::moved(start, 0, 1, 0, 0), testing::moved(beside, 0, 1, 0, 0)}));
  EXPECT_TRUE(kept_by_directions({ContactKind::kVertexFace, start, beside}));
}

TEST(ElementaryStages, DirectionsTellPairsOfABlockApart) {
  std::mt19937_64 random(26);
  std::vector<VertexMotion> vertices;
  std::vector<FeaturePair> pairs;
  std::vector<std::uint16_t> expected;
  std::vector<std::uint16_t> survivors;
  for (std::uint16_t i = 0; i < 511; ++i) {
    const FeatureCase pair(kKinds[i % 2], on_grid(random), on_grid(random));
    const auto first = static_cast<std::uint32_t>(vertices.size());
    vertices.insert(vertices.end(), pair.vertices.begin(), pair.vertices.end());
    pairs.push_back({{first, first + 1, first + 2, first + 3}, 0, 0, pair.kind});
    if (i % 5 == 0) continue;  // lost at an earlier stage
    survivors.push_back(i);
    if (kept_by_directions(pair)) expected.push_back(i);
  }
  survivors.resize(separation_filter(pairs, vertices, survivors.data(), survivors.size()));
  EXPECT_EQ(survivors, expected);
  EXPECT_GT(expected.size(), 50U);
  EXPECT_LT(expected.size(), 350U);
}

}  // namespace
}  // namespace warmfront

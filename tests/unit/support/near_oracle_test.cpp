// SPDX-License-Identifier: Apache-2.0
// The oracle for separations against cases solved by hand, distances in long double, and the oracle for
// touching.
#include "tests/support/near_oracle.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "tests/support/distance.h"
#include "tests/support/near_torture.h"
#include "tests/support/torture.h"

namespace warmfront::testing {
namespace {

constexpr ContactKind kVF = ContactKind::kVertexFace;
constexpr ContactKind kEE = ContactKind::kEdgeEdge;

ExactTruth truth(ContactKind kind, const Points& t0, const Points& t1, double separation) {
  return near_truth(FeatureCase(kind, t0, t1).features(), separation);
}

void expect_contact(const ExactTruth& t, double toi, bool exact = true) {
  EXPECT_TRUE(t.contact);
  EXPECT_EQ(t.toi, toi);
  EXPECT_EQ(t.toi_exact, exact);
  EXPECT_EQ(t.at_start, toi == 0);
}

Points with_first(Points points, double x, double y, double z) {
  points[0] = {x, y, z};
  return points;
}

TEST(NearOracle, OverAFace) {
  const Points far = with_first(kTriangleBelow, 0.25, 0.25, 2);
  const Points onto = with_first(kTriangleBelow, 0.25, 0.25, 0);
  expect_contact(truth(kVF, far, onto, 1), 0.5);
  expect_contact(truth(kVF, far, onto, 2), 0);
  expect_contact(truth(kVF, far, onto, 0x1p-1074), std::nextafter(1.0, 0.0), false);
  EXPECT_FALSE(truth(kVF, far, kTriangleBelow, std::nextafter(1.0, 0.0)).contact);
  expect_contact(truth(kVF, far, kTriangleBelow, 1), 1);
}

// Past a corner, (3, 4) away at t = 1/2; and past an edge's inner points.
TEST(NearOracle, GrazingAtOneInstant) {
  const Points corner{{{-4, 0, 4}, {0, 0, 0}, {1, 0, -1}, {1, 1, -1}}};
  Points from = with_first(corner, 0, -8, 5);
  Points to = with_first(corner, 0, 8, 5);
  expect_contact(truth(kVF, from, to, 5), 0.5);
  EXPECT_FALSE(truth(kVF, from, to, std::nextafter(5.0, 0.0)).contact);
  const Points edges{{{0, -3, 4}, {0, -3, 9}, {-1, 0, 0}, {1, 0, 0}}};
  Points by = edges;
  for (int k = 0; k < 2; ++k) by[k][0] += 10;
  expect_contact(truth(kEE, edges, by, 5), 0);
  for (int k = 0; k < 2; ++k) by[k] = {10, -3 - 40.0, by[k][2] + 30};  // along the tangent at (3, 4)
  expect_contact(truth(kEE, by, edges, 5), 1);
  EXPECT_FALSE(truth(kEE, by, edges, std::nextafter(5.0, 0.0)).contact);
}

TEST(NearOracle, SlidesOverTheRimAtExactlyTheSeparation) {
  const Points from = with_first(kTriangleBelow, -3, 0.25, 1);
  const Points to = with_first(kTriangleBelow, 1, 0.25, 1);
  expect_contact(truth(kVF, from, to, 1), 0.75);
  EXPECT_FALSE(truth(kVF, from, to, std::nextafter(1.0, 0.0)).contact);
}

TEST(NearOracle, AFirstTimeThatIsIrrational) {
  // (1 - t)^2 + 1 = 2 - 1/2: t = 1 - sqrt(1/2).
  const Points points{{{1, 1, 0}, {0, 0, 0}, {0, 0, 0}, {0, 0, 0}}};
  const ExactTruth t = truth(kVF, points, with_first(points, 0, 1, 0), std::sqrt(1.5));
  EXPECT_TRUE(t.contact);
  EXPECT_NEAR(t.toi, 1 - std::sqrt(0.5), 1e-15);
}

TEST(NearOracle, WithoutASeparationIsTheOracleForTouching) {
  std::mt19937_64 random(5);
  int contacts = 0;
  for (const TortureFamily& family : torture_families()) {
    for (int trial = 0; trial < 10; ++trial) {
      const FeatureCase query = family.make(random, trial % 2 == 0 ? kVF : kEE);
      const ExactTruth touching = exact_truth(query.features());
      const ExactTruth near = near_truth(query.features(), 0);
      ASSERT_EQ(near.contact, touching.contact) << family.name << to_text(query);
      ASSERT_EQ(near.toi, touching.toi) << family.name << to_text(query);
      ASSERT_EQ(near.at_start, touching.at_start);
      ASSERT_EQ(near.toi_exact, touching.toi_exact);
      contacts += near.contact;
    }
  }
  EXPECT_GT(contacts, 100);
}

// The distance in long double: the separation at the first time, and no less before or, without one, ever.
TEST(NearOracle, AgreesWithDistances) {
  std::mt19937_64 random(6);
  int later = 0, none = 0;
  for (int trial = 0; trial < 300; ++trial) {
    const ContactKind kind = trial % 2 == 0 ? kVF : kEE;
    const FeatureCase query = torture_families()[0].make(random, kind);
    double size = 0;
    const int others = kind == kVF ? 1 : 2;
    for (int k = others; k < 4; ++k) {
      for (int j = 0; j < others; ++j) {
        for (int axis = 0; axis < 3; ++axis) {
          const auto& a = query.vertices[j];
          const auto& b = query.vertices[k];
          size = std::max({size, std::fabs(a.t0[axis] - b.t0[axis]), std::fabs(a.t1[axis] - b.t1[axis])});
        }
      }
    }
    const double separation = any_separation(random, query);
    const long double share = static_cast<long double>(separation) / size;
    const ExactTruth found = near_truth(query.features(), separation);
    later += found.contact && !found.at_start;
    none += !found.contact;
    for (int i = 0; i <= 64; ++i) {
      const double t = i / 64.0;
      if (found.contact && t >= found.toi) break;
      ASSERT_GT(relative_distance(query.features(), t), share * (1 - 1e-15L)) << trial << " " << t;
    }
    if (!found.contact) continue;
    const long double then = relative_distance(query.features(), found.toi);
    ASSERT_LE(then, share + 1e-14L) << trial;
    if (!found.at_start) {
      ASSERT_GE(then, share - 1e-14L) << trial;
    }
  }
  EXPECT_GT(later, 50);
  EXPECT_GT(none, 10);
}

// The families hold what they are for: contacts later than the start, and pairs that stay apart.
TEST(NearOracle, FamiliesHaveBothAnswers) {
  for (const NearFamily& family : near_families()) {
    std::mt19937_64 random(7);
    int later = 0, none = 0;
    for (int trial = 0; trial < 200; ++trial) {
      const NearCase made = family.make(random, trial % 2 == 0 ? kVF : kEE);
      const ExactTruth found = near_truth(made.query.features(), made.separation);
      later += found.contact && !found.at_start;
      none += !found.contact;
    }
    EXPECT_GT(later, 10) << family.name;
    EXPECT_GT(none, 10) << family.name;
  }
}

}  // namespace
}  // namespace warmfront::testing

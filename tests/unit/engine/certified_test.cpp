// SPDX-License-Identifier: Apache-2.0
// The certified tier: it never misses, its toi is never late, and its proofs are right.
#include "engine/elementary/certified.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <iostream>
#include <random>

#include "engine/narrow_phase/coplanarity_filter.h"
#include "engine/narrow_phase/feature_block.h"
#include "tests/support/data.h"
#include "tests/support/feature_case.h"
#include "tests/support/query_file.h"

namespace warmfront {
namespace {

using testing::kTriangleBelow;
using testing::moved;
using testing::Points;

struct Case : testing::FeatureCase {
  using FeatureCase::FeatureCase;

  Verdict test(const CertifiedOptions& options = {}) const { return certified_test(features(), options); }
  bool survives_filter(double separation = 0) const {
    const FeaturePair pair{{0, 1, 2, 3}, 0, 0, kind};
    std::uint16_t survivor = 0;
    return coplanarity_filter({&pair, 1}, vertices, {&separation, separation > 0 ? 1U : 0U}, &survivor) == 1;
  }
};

TEST(Certified, VertexThroughFace) {
  const Case hit(ContactKind::kVertexFace, kTriangleBelow, moved(kTriangleBelow, 0, 0, 0, -2));
  const Verdict verdict = hit.test();
  EXPECT_TRUE(verdict.contact);
  EXPECT_EQ(verdict.status, ContactStatus::kHit);
  EXPECT_LE(verdict.toi, 0.5);
  EXPECT_GT(verdict.toi, 0.5 - 1e-6);
}

TEST(Certified, VertexPassesBeside) {
  const Case miss(ContactKind::kVertexFace, moved(kTriangleBelow, 0, 0.6, 0.6, 0),
                  moved(kTriangleBelow, 0, 0.6, 0.6, -2));
  EXPECT_FALSE(miss.test().contact);
}

TEST(Certified, TouchingExactlyAtTheEnd) {
  const Case touch(ContactKind::kVertexFace, kTriangleBelow, moved(kTriangleBelow, 0, 0, 0, -1));
  const Verdict verdict = touch.test();
  EXPECT_TRUE(verdict.contact);
  EXPECT_EQ(verdict.status, ContactStatus::kPossible);
  EXPECT_GT(verdict.toi, 1 - 1e-5);
  EXPECT_LE(verdict.toi, 1);
}

TEST(Certified, TouchingAtTheStart) {
  const Points start = moved(kTriangleBelow, 0, 0, 0, -1);
  const Verdict verdict = Case(ContactKind::kVertexFace, start, moved(start, 0, 0, 0, 1)).test();
  EXPECT_TRUE(verdict.contact);
  EXPECT_EQ(verdict.status, ContactStatus::kOverlapAtStart);
  EXPECT_EQ(verdict.toi, 0);
}

TEST(Certified, NothingMoves) {
  EXPECT_FALSE(Case(ContactKind::kVertexFace, kTriangleBelow, kTriangleBelow).test().contact);
  const Points flat = moved(kTriangleBelow, 0, 0, 0, -1);
  EXPECT_TRUE(Case(ContactKind::kVertexFace, flat, flat).test().contact);
}

// The property that separating planes rely on (engine/broad_phase/apart_parts.h), near its limits.
TEST(Certified, NothingIsReportedOfWhatADirectionKeepsApart) {
  std::mt19937_64 random(11);
  const auto uniform = [&] { return static_cast<double>(random() >> 11) * 0x1p-52 - 1; };
  for (int trial = 0; trial < 60'000; ++trial) {
    const ContactKind kind = trial % 2 == 0 ? ContactKind::kVertexFace : ContactKind::kEdgeEdge;
    const int of_first = kind == ContactKind::kVertexFace ? 1 : 2;
    const double tolerance = std::pow(10.0, -1.0 - static_cast<double>(random() % 7));
    // In their own planes, exactly or roughly, at a distance that is hardly enough.
    const double rough = random() % 2 == 0 ? 0 : 0.5 * (uniform() + 1);
    const double far = random() % 3 == 0 ? 10 : 1;
    const double fast = std::pow(10.0, uniform());
    std::array<std::array<Vec3, 4>, 2> x;
    const Vec3 drift{fast * uniform(), fast * uniform(), 0};
    double size = 0;
    for (int k = 0; k < 4; ++k) {
      x[0][k] = {uniform(), uniform(), rough * std::fabs(uniform())};
      if (k >= of_first && far > 1) x[0][k].x += far * uniform();
      x[1][k] = {x[0][k].x + 0.1 * fast * uniform(), x[0][k].y + 0.1 * fast * uniform(),
                 rough * std::fabs(uniform())};
      if (k < of_first) x[1][k] = x[1][k] + drift;
    }
    for (const auto& end : x) {
      for (const Vec3& a : end)
        for (const Vec3& b : end) size = std::max(size, max_abs(b - a));
    }
    const double gap = 1.01 * certified_reach(tolerance) * (size + 1);
    const double turn = random() % 2 == 0 ? 0 : 3 * uniform();
    const double lean = random() % 2 == 0 ? 0 : 3 * uniform();
    Case apart(kind, {}, {});
    for (int k = 0; k < 4; ++k) {
      for (int end = 0; end < 2; ++end) {
        Vec3 p = x[end][k];
        p.z = k < of_first ? -p.z : p.z + gap;
        p = {std::cos(turn) * p.x - std::sin(turn) * p.y, std::sin(turn) * p.x + std::cos(turn) * p.y, p.z};
        p = {std::cos(lean) * p.x - std::sin(lean) * p.z, p.y, std::sin(lean) * p.x + std::cos(lean) * p.z};
        (end == 0 ? apart.vertices[k].t0 : apart.vertices[k].t1) = {p.x, p.y, p.z, 0};
      }
    }
    const Verdict verdict = apart.test({.tolerance = tolerance});
    ASSERT_FALSE(verdict.contact) << trial << ": status " << static_cast<int>(verdict.status);
  }
}

// Two edges in planes that are hardly farther apart than the reach, equal and parallel and side by side,
// while they turn together: the way from one to the other turns with them, 2^18 directions in all, and only
// that from plane to plane serves all the time.
Case turning_side_by_side(double apart) {
  Points t0{{{0, 0, 0}, {1, 0, 0}, {0, apart, apart}, {1, apart, apart}}};
  Points t1{{{0, 0, 0}, {0, 1, 0}, {-apart, 0, apart}, {-apart, 1, apart}}};
  // Along none of the axes that bounds know.
  for (Points* end : {&t0, &t1}) {
    for (auto& [x, y, z] : *end) {
      const std::array<double, 2> xz{0.8 * x - 0.6 * z, 0.6 * x + 0.8 * z};
      x = xz[0];
      const std::array<double, 2> yz{0.96 * y - 0.28 * xz[1], 0.28 * y + 0.96 * xz[1]};
      y = yz[0];
      z = yz[1];
    }
  }
  return {ContactKind::kEdgeEdge, t0, t1};
}

TEST(Certified, NothingIsReportedOfEdgesThatTurnSideBySide) {
  for (const double tolerance : {1e-9, 1e-6, 1e-4, 1e-3}) {
    const Case apart = turning_side_by_side(1.01 * certified_reach(tolerance));
    const Verdict verdict = apart.test({.tolerance = tolerance});
    EXPECT_FALSE(verdict.contact) << tolerance << ": status " << static_cast<int>(verdict.status);
    EXPECT_FALSE(apart.test({.tolerance = tolerance, .budget = 1}).contact) << tolerance;
  }
  // Not vacuous: pairs as near as the error of distances are reported.
  EXPECT_TRUE(turning_side_by_side(0x1p-24).test({.tolerance = 1e-9}).contact);
}

// The property that rigid parts rely on (engine/state/rigid_parts.h), near its limits: their pairs rotate
// together, and shrink meanwhile.
TEST(Certified, NothingIsReportedOfWhatStaysApartAndTurnsAsOne) {
  std::mt19937_64 random(12);
  const auto uniform = [&] { return static_cast<double>(random() >> 11) * 0x1p-52 - 1; };
  for (int trial = 0; trial < 20'000; ++trial) {
    const ContactKind kind = trial % 2 == 0 ? ContactKind::kVertexFace : ContactKind::kEdgeEdge;
    const int of_first = kind == ContactKind::kVertexFace ? 1 : 2;
    const double tolerance = std::pow(10.0, -2.0 - static_cast<double>(random() % 6));
    const double thin = random() % 2 == 0 ? 1 : std::ldexp(1.0, -static_cast<int>(random() % 50));
    const double separation = random() % 2 == 0 ? 0 : std::pow(10.0, -3 * std::fabs(uniform()));
    const double angle = std::ldexp(1.5, -static_cast<int>(random() % 12));
    testing::Points x;
    for (auto& p : x) p = {uniform(), thin * uniform(), 0};
    if (random() % 3 == 0) {  // parallel
      for (int axis = 0; axis < 3; ++axis) x[3][axis] = x[2][axis] + x[1][axis] - x[0][axis];
    }
    // No two points are farther apart than 4, and 1 or so for the gap.
    const double chord = 2 * std::sin(angle / 2);
    const double least = 1.01 * std::max(certified_reach(tolerance) * 6, chord * 6 / kSurelyDecided);
    const double gap = (separation + least) / std::cos(angle / 2);
    for (int k = of_first; k < 4; ++k) x[k][2] = gap;
    const double lean = 3 * uniform();
    Case apart(kind, {}, {});
    for (int k = 0; k < 4; ++k) {
      const auto& [a, b, c] = x[k];
      const std::array<double, 3> at{std::cos(lean) * a - std::sin(lean) * c, b,
                                     std::sin(lean) * a + std::cos(lean) * c};
      apart.vertices[k].t0 = {at[0], at[1], at[2], 0};
      apart.vertices[k].t1 = {std::cos(angle) * at[0] - std::sin(angle) * at[1],
                              std::sin(angle) * at[0] + std::cos(angle) * at[1], at[2], 0};
    }
    const Verdict verdict = apart.test({.tolerance = tolerance, .min_separation = separation});
    ASSERT_FALSE(verdict.contact) << trial << ": status " << static_cast<int>(verdict.status);
    ASSERT_FALSE(apart.test({.tolerance = tolerance, .min_separation = separation, .budget = 1}).contact)
        << trial;
  }
}

TEST(Certified, MotionWithinAPlane) {
  const Points start{{{3, 0.25, 0}, {0, 0, 0}, {1, 0, 0}, {0, 1, 0}}};
  const Verdict in = Case(ContactKind::kVertexFace, start, moved(start, 0, -3, 0, 0)).test();
  EXPECT_TRUE(in.contact);
  EXPECT_NEAR(in.toi, 0.75, 1e-5);  // reaches the hypotenuse at x = 0.75
  EXPECT_LE(in.toi, 0.75);
  EXPECT_FALSE(Case(ContactKind::kVertexFace, start, moved(start, 0, -2, 0, 0)).test().contact);
  EXPECT_FALSE(Case(ContactKind::kVertexFace, start, moved(start, 0, -6, 4, 0)).test().contact);
}

TEST(Certified, ParallelEdges) {
  const Points apart{{{0, 0, 0}, {1, 0, 0}, {0.5, 1, 0}, {2, 1, 0}}};
  const Points through = moved(moved(apart, 2, 0, -2, 0), 3, 0, -2, 0);
  const Verdict verdict = Case(ContactKind::kEdgeEdge, apart, through).test();
  EXPECT_TRUE(verdict.contact);
  EXPECT_NEAR(verdict.toi, 0.5, 1e-5);
  // Along one line, one behind the other, never reaching.
  const Points line{{{0, 0, 0}, {1, 1, 1}, {2, 2, 2}, {3, 3, 3}}};
  EXPECT_FALSE(Case(ContactKind::kEdgeEdge, line, moved(line, 2, -0.9, -0.9, -0.9)).test().contact);
  EXPECT_TRUE(Case(ContactKind::kEdgeEdge, line, moved(line, 2, -1.5, -1.5, -1.5)).test().contact);
}

TEST(Certified, DegeneratePrimitives) {
  // The face is a point, the edges are points.
  const Points point{{{0, 0, 1}, {0, 0, 0}, {0, 0, 0}, {0, 0, 0}}};
  EXPECT_TRUE(Case(ContactKind::kVertexFace, point, moved(point, 0, 0, 0, -2)).test().contact);
  EXPECT_FALSE(Case(ContactKind::kVertexFace, point, moved(point, 0, 0.1, 0, -2)).test().contact);
  const Points edges{{{0, 0, 1}, {0, 0, 1}, {0, 0, 0}, {0, 0, 0}}};
  const Points meet{{{0, 0, -1}, {0, 0, -1}, {0, 0, 0}, {0, 0, 0}}};
  EXPECT_TRUE(Case(ContactKind::kEdgeEdge, edges, meet).test().contact);
  const Points same{{{5, 5, 5}, {5, 5, 5}, {5, 5, 5}, {5, 5, 5}}};
  EXPECT_EQ(Case(ContactKind::kEdgeEdge, same, same).test().status, ContactStatus::kOverlapAtStart);
}

TEST(Certified, FirstOfSeveralRoots) {
  // The vertex swings through the plane and the triangle tilts after it: through, back and through.
  const Points t0{{{0.3, 0.3, 1}, {0, 0, 0}, {1, 0, 0}, {0, 1, 0}}};
  const Points t1{{{0.3, 0.3, -1}, {0, 0, -4}, {1, 0, 3}, {0, 1, 3}}};
  const Verdict verdict = Case(ContactKind::kVertexFace, t0, t1).test();
  EXPECT_TRUE(verdict.contact);
  EXPECT_LE(verdict.toi, 0.7143);
}

TEST(Certified, MinimumSeparation) {
  const Points near = moved(kTriangleBelow, 0, 0, 0, -0.75);
  const Case passes(ContactKind::kVertexFace, near, moved(near, 0, 0.2, 0.2, 0));
  EXPECT_FALSE(passes.test().contact);
  EXPECT_FALSE(passes.test({.min_separation = 0.24}).contact);
  EXPECT_TRUE(passes.survives_filter(0.26));
  const Verdict verdict = passes.test({.min_separation = 0.26});
  EXPECT_TRUE(verdict.contact);
  EXPECT_EQ(verdict.toi, 0);
  const Verdict falls = Case(ContactKind::kVertexFace, kTriangleBelow, moved(kTriangleBelow, 0, 0, 0, -2))
                            .test({.min_separation = 0.5});
  EXPECT_TRUE(falls.contact);
  EXPECT_EQ(falls.status, ContactStatus::kHit);
  EXPECT_NEAR(falls.toi, 0.25, 1e-5);
  EXPECT_LE(falls.toi, 0.25);
  EXPECT_TRUE(passes.test({.min_separation = 1e300}).contact);
}

TEST(Certified, OnlyUntilTheLatestTimeAskedFor) {
  const Case hit(ContactKind::kVertexFace, kTriangleBelow, moved(kTriangleBelow, 0, 0, 0, -2));
  EXPECT_FALSE(hit.test({.latest = 0.49}).contact);
  EXPECT_EQ(hit.test({.latest = 0.51}).toi, hit.test().toi);
}

// Found by MadeContacts: clipping took the cubic's hull between its upper and lower points only, and cut off
// the root by more than its error when both ends of a window carried the same error.
TEST(Certified, ClippingKeepsARootNearTheWindowsEnd) {
  const Points t0{{{-0x1.2508p+13, 0x1.624p+10, -0x1.2f1p+12},
                   {0x1.0bep+13, -0x1.345p+13, 0x1.74f8p+13},
                   {-0x1.08cp+11, -0x1.3f8p+12, -0x1.122p+12},
                   {-0x1.92bp+12, 0x1.1cap+12, 0x1.6e6p+12}}};
  const Points t1{{{-0x1.386p+11, -0x1.511p+12, 0x1.bdp+8},
                   {0x1.044p+12, -0x1.22cp+11, 0x1.342p+11},
                   {-0x1.545p+13, -0x1.3f8p+12, -0x1.20ep+12},
                   {-0x1.fd4p+10, 0x1.3f3p+13, 0x1.bb4p+11}}};
  const Verdict verdict = Case(ContactKind::kVertexFace, t0, t1).test();
  EXPECT_TRUE(verdict.contact);
  EXPECT_LE(verdict.toi, 0.5);
}

// Found in review: the filter's bound e g q underflowed in e g although q is large, and dropped true
// contacts.
TEST(CoplanarityFilter, KeepsContactsBetweenTinyAndHugeCoordinates) {
  std::mt19937_64 random(1);
  const auto bits = [&](int n) { return static_cast<double>(random() >> (64 - n)); };
  for (const auto& [small, big] : {std::pair(-532, 170), std::pair(-563, 343), std::pair(-603, 443)}) {
    for (int trial = 0; trial < 2000; ++trial) {
      // All points lie exactly in the plane z = 3 x + 5 y, vertex 0 at the origin within the triangle.
      const auto point = [](double x, double y, int e) {
        return std::array{std::ldexp(x, e), std::ldexp(y, e), std::ldexp(3 * x + 5 * y, e)};
      };
      const double ax = bits(40), ay = bits(40), bx = -bits(40), by = bits(40), u = bits(5) + 1,
                   w = bits(5) + 1;
      const Points at{{{0, 0, 0},
                       point(ax, ay, small),
                       point(bx, by, small),
                       point(-(u * ax + w * bx), -(u * ay + w * by), big)}};
      ASSERT_TRUE(Case(ContactKind::kVertexFace, at, at).survives_filter()) << trial;
    }
  }
}

// Found in review: for needles the foot of the perpendicular was rounding noise, taken for a near point of
// the face.
TEST(Certified, NeedlesAreNotNearerThanTheyAre) {
  const Points needle{
      {{0, 0, 0},
       {0x1.aa094c2a4a9bcp-7, -0x1.bf8fb6994be9cp-7, -0x1.d85a51ec7ce0ap-5},
       {-0x1.b390db17fea59p-1, 0x1.8c49d07024994p-1, 0x1.d9c18be741c03p-2},
       {-0x1.8a1ccdc43ffaep-4, 0x1.600717619dc54p-4, 0x1.0a94e7cb7eb72p-7}}};  // 0.045048 away
  const Case still(ContactKind::kVertexFace, needle, needle);
  for (const double share : {0.5, 0.8, 0.9, 0.95, 0.99}) {
    EXPECT_FALSE(still.test({.tolerance = 1e-9, .min_separation = share * 0.045048}).contact) << share;
  }
  EXPECT_TRUE(still.test({.tolerance = 1e-9, .min_separation = 0.0451}).contact);
}

// Found by torture: the closest point of an edge to one of no length was taken for its end.
TEST(Certified, AnEdgeOfNoLengthIsNotNearerThanItIs) {
  const Points t0{{{-64, 64, -127}, {64, -64, 0}, {0, 0, -64}, {0, 0, -64}}};
  const Points t1{{{-0x1.0000000002p+6, 0x1.fffffffffap+5, -0x1.fbfffffffdp+6},
                   {0x1.fffffffffcp+5, -0x1.0000000003p+6, 0x1.8p-33},
                   {-0x1p-33, -0x1.8p-33, -0x1.fffffffffap+5},
                   {-0x1p-33, -0x1.8p-33, -0x1.fffffffffap+5}}};
  EXPECT_FALSE(Case(ContactKind::kEdgeEdge, t0, t1).test().contact);  // 0.4 apart
}

// Found by torture: one clip of the cubic leapt from a wide window to one as narrow as the tolerance asks,
// and the pair was reported although it stays four tolerances apart.
TEST(Certified, AWindowReachedInOneLeapIsLookedAtAgain) {
  const Points t0{{{0x1.fffffffffffffp+1023, -0x1.fffffffffffffp+1023, 0x1.ddb60ac111c67p+1023},
                   {0x0p+0, 0x1.7b633b9b5750fp+1021, -0x1.c9ad552940ce7p+1023},
                   {-0x1.a82a806424ce3p+1022, 0x0p+0, 0x0p+0},
                   {0x1.fffffffffffffp+1023, 0x0p+0, 0x1.fffffffffffffp+1023}}};
  const Points t1{{{0x1.879cdc7d2b283p+1023, 0x1.6a12a0a302e8fp+1021, 0x1.fffffffffffffp+1023},
                   {-0x1.fffffffffffffp+1023, 0x1.24fc78aa77cebp+1023, 0x1.21a974ed7cff1p+1023},
                   {0x0p+0, 0x0p+0, -0x1.341f034ffa3a5p+1023},
                   {0x1.89f54357a31ebp+1022, -0x1.c7e9b4358e9bdp+1023, 0x1.fffffffffffffp+1023}}};
  EXPECT_FALSE(Case(ContactKind::kEdgeEdge, t0, t1).test({.tolerance = 1e-2}).contact);
}

// Contacts made exact: at t = 1/2 the primitives meet at points with dyadic coordinates, for any motion
// before and after. All arithmetic here is on integers below 2^53, so the contact is certain, at any scale
// and offset.
class MadeContacts : public ::testing::TestWithParam<std::pair<int, double>> {};

TEST_P(MadeContacts, AreNeverMissedAndNeverLate) {
  const auto [scale, offset] = GetParam();
  std::mt19937_64 random(7);
  const auto integer = [&](int bound) {
    return static_cast<double>(static_cast<std::int64_t>(random() % (2 * bound + 1)) - bound);
  };
  int proved = 0;
  for (int trial = 0; trial < 4000; ++trial) {
    const auto kind = trial % 2 == 0 ? ContactKind::kVertexFace : ContactKind::kEdgeEdge;
    // Positions at t = 1/2, multiples of 8, and the first vertex put where it meets: weights in eighths, some
    // of them 0.
    Points half;
    for (auto& p : half)
      for (double& x : p) x = 8 * integer(1000);
    const int u = static_cast<int>(random() % 9);
    const int w = static_cast<int>(random() % (9 - u));
    if (trial % 5 == 0) half[3] = half[2];  // degenerate
    if (trial % 7 == 0)
      for (auto& p : half) p[2] = 0;  // within a plane
    for (int axis = 0; axis < 3; ++axis) {
      if (kind == ContactKind::kVertexFace) {
        half[0][axis] = (u * half[1][axis] + w * half[2][axis] + (8 - u - w) * half[3][axis]) / 8;
      } else {
        // Vertex 0 such that the point at 1/2 of edge (0, 1) lies at u/8 of edge (2, 3).
        half[0][axis] = 2 * (u * half[2][axis] + (8 - u) * half[3][axis]) / 8 - half[1][axis];
      }
    }
    Points t0;
    Points t1;
    const int motion = trial % 3 == 0 ? 10 : 5000;
    for (int k = 0; k < 4; ++k) {
      for (int axis = 0; axis < 3; ++axis) {
        const double d = trial % 7 == 0 && axis == 2 ? 0 : integer(motion);
        t0[k][axis] = std::ldexp(half[k][axis] + d + offset, scale);
        t1[k][axis] = std::ldexp(half[k][axis] - d + offset, scale);
      }
    }
    const Case made(kind, t0, t1);
    EXPECT_TRUE(made.survives_filter()) << trial;
    const Verdict verdict = made.test();
    ASSERT_TRUE(verdict.contact) << trial;
    ASSERT_LE(verdict.toi, 0.5) << trial;
    ASSERT_NE(verdict.status, ContactStatus::kBudget) << trial;
    proved += verdict.status == ContactStatus::kHit;
    const Verdict with_tolerance = made.test({.tolerance = 1e-2});
    ASSERT_TRUE(with_tolerance.contact) << trial;
    ASSERT_LE(with_tolerance.toi, 0.5) << trial;
    ASSERT_TRUE(made.test({.min_separation = std::ldexp(3.0, scale)}).contact) << trial;
  }
  if (offset == 0) {
    EXPECT_GT(proved, 500);
  }
}

INSTANTIATE_TEST_SUITE_P(Scales, MadeContacts,
                         ::testing::Values(std::pair(0, 0.0), std::pair(-30, 0.0), std::pair(-1040, 0.0),
                                           std::pair(-1000, 0.0), std::pair(990, 0.0), std::pair(0, 0x1p20),
                                           std::pair(0, 0x1p40), std::pair(-600, 0x1p40)));

// Pairs reported free must be free: every sampled closest distance exceeds zero, and misses are symmetric in
// time. (The query sets below have the hard cases; this test is broad.)
TEST(Certified, FreeMeansFreeInBothDirectionsOfTime) {
  std::mt19937_64 random(11);
  const auto uniform = [&] { return static_cast<double>(random() >> 11) * 0x1p-52 - 1; };
  int free = 0;
  for (int trial = 0; trial < 20000; ++trial) {
    Points t0;
    Points t1;
    for (int k = 0; k < 4; ++k)
      for (int axis = 0; axis < 3; ++axis) {
        t0[k][axis] = uniform();
        t1[k][axis] = uniform();
      }
    const auto kind = trial % 2 == 0 ? ContactKind::kVertexFace : ContactKind::kEdgeEdge;
    const Verdict forward = Case(kind, t0, t1).test();
    const Verdict backward = Case(kind, t1, t0).test();
    if (forward.contact && forward.status == ContactStatus::kHit) {
      EXPECT_TRUE(backward.contact) << trial;
    }
    if (backward.contact && backward.status == ContactStatus::kHit) {
      EXPECT_TRUE(forward.contact) << trial;
    }
    free += !forward.contact;
    if (!Case(kind, t0, t1).survives_filter()) {
      EXPECT_FALSE(forward.contact) << trial;
    }
  }
  EXPECT_GT(free, 10000);
}

// Real and hand-made hard queries with symbolic truth: no false negatives, and proofs are right.
TEST(Certified, QuerySets) {
  WARMFRONT_NEED_DATA("queries");
  for (const char* kind_name : {"vertex-face", "edge-edge"}) {
    const auto kind = kind_name[0] == 'v' ? ContactKind::kVertexFace : ContactKind::kEdgeEdge;
    int queries = 0, negatives = 0, false_positives = 0, undecided = 0, budget = 0;
    for (const auto& entry :
         std::filesystem::recursive_directory_iterator(testing::data_root() / "queries")) {
      if (entry.path().extension() != ".csv" || entry.path().parent_path().filename() != kind_name) continue;
      for (const testing::FileQuery& query : testing::read_queries(entry.path())) {
        const auto& v = query.vertices;
        const Verdict verdict = certified_test({kind, {&v[0], &v[1], &v[2], &v[3]}}, {});
        ++queries;
        negatives += query.truth && !verdict.contact;
        false_positives += !query.truth && verdict.contact;
        undecided += verdict.contact && verdict.status == ContactStatus::kPossible;
        budget += verdict.contact && verdict.status == ContactStatus::kBudget;
        if (verdict.contact && verdict.status == ContactStatus::kHit) {
          EXPECT_TRUE(query.truth) << entry.path() << " " << queries;
        }
        const FeaturePair pair{{0, 1, 2, 3}, 0, 0, kind};
        std::uint16_t survivor = 0;
        if (query.truth) {
          EXPECT_EQ(coplanarity_filter({&pair, 1}, v, {}, &survivor), 1U) << entry.path() << " " << queries;
        }
      }
    }
    std::cout << kind_name << ": " << queries << " queries, " << negatives << " false negatives, "
              << false_positives << " false positives, " << undecided << " possible, " << budget
              << " out of budget\n";
    EXPECT_GT(queries, 0);
    EXPECT_EQ(negatives, 0);
    EXPECT_EQ(budget, 0);
  }
}

}  // namespace
}  // namespace warmfront

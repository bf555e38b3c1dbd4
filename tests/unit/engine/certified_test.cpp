// SPDX-License-Identifier: Apache-2.0
// The certified tier: it never misses, its toi is never late, and its proofs are right.
#include "engine/elementary/certified.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "tests/support/feature_case.h"
#include "tests/support/query_file.h"
#include "tests/unit/engine/certified_case.h"

namespace warmfront {
namespace {

using Case = testing::CertifiedCase;
using testing::kTriangleBelow;
using testing::moved;
using testing::Points;

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

}  // namespace
}  // namespace warmfront

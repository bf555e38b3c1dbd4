// SPDX-License-Identifier: Apache-2.0
// The exact tier: named cases of every degenerate class with their first times worked out by hand,
// invariances, the hard queries and the real steps with symbolic truth. (The property tests hold it to the
// oracle at random.)
#include "engine/elementary/exact.h"

#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <iostream>
#include <random>

#include "engine/elementary/certified.h"
#include "engine/options.h"
#include "tests/support/data.h"
#include "tests/support/exact_oracle.h"
#include "tests/support/feature_case.h"
#include "tests/support/query_file.h"

namespace warmfront {
namespace {

using testing::FeatureCase;
using testing::kTriangleBelow;
using testing::moved;
using testing::Points;

constexpr auto kVf = ContactKind::kVertexFace;
constexpr auto kEe = ContactKind::kEdgeEdge;

// The first time of contact, or 2 for none. Also checks the verdict's other guarantees.
double first_time(ContactKind kind, const Points& t0, const Points& t1, double latest = 1) {
  std::uint64_t exact_tests = 0;
  const Verdict verdict = exact_test(FeatureCase(kind, t0, t1).features(), latest, exact_tests);
  if (!verdict.contact) return 2;
  EXPECT_EQ(verdict.status, verdict.toi == 0 ? ContactStatus::kOverlapAtStart : ContactStatus::kHit);
  return verdict.toi;
}

Points all_moved(Points points, double x, double y, double z, int first = 0, int last = 3) {
  for (int k = first; k <= last; ++k) points = moved(points, k, x, y, z);
  return points;
}

double below(double x) {
  return std::nextafter(x, 0.0);
}

TEST(Exact, VertexThroughFace) {
  EXPECT_EQ(first_time(kVf, kTriangleBelow, moved(kTriangleBelow, 0, 0, 0, -2)), 0.5);
  // 1/3 is not a double; the constant is the double nearest to it, which is below it.
  EXPECT_EQ(first_time(kVf, kTriangleBelow, moved(kTriangleBelow, 0, 0, 0, -3)), 1.0 / 3);
  // 1/5: the nearest double is above it.
  EXPECT_EQ(first_time(kVf, kTriangleBelow, moved(kTriangleBelow, 0, 0, 0, -5)), below(0.2));
  EXPECT_EQ(first_time(kVf, moved(kTriangleBelow, 0, 1, 1, 0), moved(kTriangleBelow, 0, 1, 1, -2)), 2);
}

TEST(Exact, AtTheEndsOfTheStep) {
  EXPECT_EQ(first_time(kVf, kTriangleBelow, moved(kTriangleBelow, 0, 0, 0, -1)), 1);
  const double short_of_it = -below(1);
  EXPECT_EQ(first_time(kVf, kTriangleBelow, moved(kTriangleBelow, 0, 0, 0, short_of_it)), 2);
  const Points touching = moved(kTriangleBelow, 0, 0, 0, -1);
  EXPECT_EQ(first_time(kVf, touching, moved(touching, 0, 0, 0, 1)), 0);
  // Contact at 2^-1076, before the least positive double; and at 2^-1074, that double.
  Points near = touching;
  near[0][2] = 0x1p-1074;
  EXPECT_EQ(first_time(kVf, near, moved(touching, 0, 0, 0, -4)), 0);
  EXPECT_EQ(first_time(kVf, near, moved(touching, 0, 0, 0, -below(1))), 0x1p-1074);
}

TEST(Exact, OnAnEdgeAtACornerAndOneUlpBeside) {
  const auto falls_at = [](double x, double y) {
    const Points above{{{x, y, 1}, {0, 0, 0}, {1, 0, 0}, {0, 1, 0}}};
    return first_time(kVf, above, moved(above, 0, 0, 0, -3));
  };
  EXPECT_EQ(falls_at(0, 0), 1.0 / 3);
  EXPECT_EQ(falls_at(1, 0), 1.0 / 3);
  EXPECT_EQ(falls_at(0.5, 0), 1.0 / 3);
  EXPECT_EQ(falls_at(0.25, 0.75), 1.0 / 3);
  EXPECT_EQ(falls_at(0.5, -0x1p-1074), 2);
  EXPECT_EQ(falls_at(std::nextafter(1.0, 2.0), 0), 2);
  EXPECT_EQ(falls_at(0.25, std::nextafter(0.75, 1.0)), 2);
}

TEST(Exact, EdgesCross) {
  const Points above{{{-1, 0, 1}, {1, 0, 1}, {0, -1, 0}, {0, 1, 0}}};
  EXPECT_EQ(first_time(kEe, above, all_moved(above, 0, 0, -4, 0, 1)), 0.25);
  EXPECT_EQ(first_time(kEe, above, all_moved(above, 0, 0, -3, 0, 1)), 1.0 / 3);
  // End on end, and one ulp too short for it.
  const Points end_on_end{{{0, 0, 1}, {1, 0, 1}, {0, 0, 0}, {0, 1, 0}}};
  EXPECT_EQ(first_time(kEe, end_on_end, all_moved(end_on_end, 0, 0, -3, 0, 1)), 1.0 / 3);
  Points too_short = end_on_end;
  too_short[0][0] = 0x1p-1074;
  EXPECT_EQ(first_time(kEe, too_short, all_moved(too_short, 0, 0, -3, 0, 1)), 2);
}

TEST(Exact, GrazingADoubleRoot) {
  // f = s^2 + 4 up, and at s = 0 the edges cross: two lines that turn past each other, touching once.
  const auto at = [](double s, double up) {
    return Points{{{-1, 0, up}, {1, s, up - s}, {0, -1, 0}, {0, 1, -s}}};
  };
  EXPECT_EQ(first_time(kEe, at(1, 0), at(-1, 0)), 0.5);
  EXPECT_EQ(first_time(kEe, at(1, 0), at(-2, 0)), 1.0 / 3);  // the double is below 1/3
  EXPECT_EQ(first_time(kEe, at(1, 0x1p-52), at(-1, 0x1p-52)), 2);
  EXPECT_EQ(first_time(kEe, at(1, -0x1p-52), at(-1, -0x1p-52)), 0.5 - 0x1p-26);
  EXPECT_EQ(first_time(kEe, at(1, 0), at(0, 0)), 1);
}

TEST(Exact, AgreesWithTheOracleOnALattice) {
  std::mt19937_64 random(5);
  int contacts = 0;
  for (int trial = 0; trial < 20000 && contacts < 300; ++trial) {
    Points t0;
    Points t1;
    for (int k = 0; k < 4; ++k)
      for (int axis = 0; axis < 3; ++axis) {
        t0[k][axis] = static_cast<double>(random() % 17) - 8;
        t1[k][axis] = static_cast<double>(random() % 17) - 8;
      }
    const ContactKind kind = trial % 2 == 0 ? kVf : kEe;
    const testing::ExactTruth truth = testing::exact_truth(FeatureCase(kind, t0, t1).features());
    ASSERT_EQ(first_time(kind, t0, t1), truth.contact ? truth.toi : 2) << trial;
    contacts += truth.contact;
  }
  EXPECT_EQ(contacts, 300);
}

TEST(Exact, WithinAPlane) {
  const Points start{{{3, 0.25, 0}, {0, 0, 0}, {1, 0, 0}, {0, 1, 0}}};
  EXPECT_EQ(first_time(kVf, start, moved(start, 0, -3, 0, 0)), 0.75);  // the hypotenuse at x = 0.75
  EXPECT_EQ(first_time(kVf, start, moved(start, 0, -2, 0, 0)), 2);
  EXPECT_EQ(first_time(kVf, start, moved(start, 0, -6, 4, 0)), 2);
  EXPECT_EQ(first_time(kVf, moved(start, 0, -2.75, 0, 0), start), 0);  // within the face at first
  // Onto a corner only: y = 0 along x, at 1, at (3 - 1) / 5.
  const Points along{{{3, 0, 0}, {0, 0, 0}, {1, 0, 0}, {0, 1, 0}}};
  EXPECT_EQ(first_time(kVf, along, moved(along, 0, -5, 0, 0)), below(0.4));  // 0.4 as a double is above 2/5
  // The same plane, turned so that no axis is zero.
  Points tilted0 = start;
  Points tilted1 = moved(start, 0, -3, 0, 0);
  for (auto* points : {&tilted0, &tilted1})
    for (auto& p : *points) p[2] = 3 * p[0] + 5 * p[1];
  EXPECT_EQ(first_time(kVf, tilted0, tilted1), 0.75);
  // Edges in a plane: end (2, 0) reaches the edge x = 0 at 2/3.
  const Points edges{{{0, -1, 0}, {0, 1, 0}, {2, 0, 0}, {4, 0, 0}}};
  EXPECT_EQ(first_time(kEe, edges, all_moved(edges, -3, 0, 0, 2, 3)), 2.0 / 3);
}

TEST(Exact, AlongALineAndParallel) {
  const Points line{{{0, 0, 0}, {1, 1, 1}, {2, 2, 2}, {3, 3, 3}}};
  EXPECT_EQ(first_time(kEe, line, all_moved(line, -4, -4, -4, 2, 3)), 0.25);
  EXPECT_EQ(first_time(kEe, line, all_moved(line, -0.5, -0.5, -0.5, 2, 3)), 2);
  EXPECT_EQ(first_time(kEe, line, all_moved(line, -1, -1, -1, 2, 3)), 1);
  const Points parallel{{{0, 0, 0}, {1, 0, 0}, {0.5, 1, 0}, {2, 1, 0}}};
  EXPECT_EQ(first_time(kEe, parallel, all_moved(parallel, 0, -2, 0, 2, 3)), 0.5);
  EXPECT_EQ(first_time(kEe, all_moved(parallel, 1, 0, 0, 2, 3), all_moved(parallel, 1, -2, 0, 2, 3)), 2);
  // Parallel at the moment of contact only: one edge turns over the other.
  const Points turning0{{{0, 0, 0}, {2, 0, 0}, {0, -1, 1}, {2, 1, 1}}};
  const Points turning1{{{0, 0, 0}, {2, 0, 0}, {0, 1, -1}, {2, -1, -1}}};
  EXPECT_EQ(first_time(kEe, turning0, turning1), 0.5);
}

TEST(Exact, PointsAndSegmentsForPrimitives) {
  const Points point{{{0, 0, 1}, {0, 0, 0}, {0, 0, 0}, {0, 0, 0}}};
  EXPECT_EQ(first_time(kVf, point, moved(point, 0, 0, 0, -4)), 0.25);
  EXPECT_EQ(first_time(kVf, point, moved(point, 0, 0x1p-1074, 0, -4)), 2);
  const Points segment{{{1, 0, 1}, {0, 0, 0}, {2, 0, 0}, {1, 0, 0}}};  // a face of no area
  EXPECT_EQ(first_time(kVf, segment, moved(segment, 0, 0, 0, -4)), 0.25);
  EXPECT_EQ(first_time(kVf, segment, moved(segment, 0, 2, 0, -4)), 0.25);
  EXPECT_EQ(first_time(kVf, segment, moved(segment, 0, 8, 0, -4)), 2);
  const Points points{{{0, 0, 1}, {0, 0, 1}, {0, 0, 0}, {0, 0, 0}}};
  EXPECT_EQ(first_time(kEe, points, all_moved(points, 0, 0, -4, 0, 1)), 0.25);
  const Points edge_and_point{{{-1, -1, 1}, {1, 1, 1}, {0, 0, 0}, {0, 0, 0}}};
  EXPECT_EQ(first_time(kEe, edge_and_point, all_moved(edge_and_point, 0, 0, -4, 0, 1)), 0.25);
  const Points same{{{5, 5, 5}, {5, 5, 5}, {5, 5, 5}, {5, 5, 5}}};
  EXPECT_EQ(first_time(kEe, same, same), 0);
  // A face that shrinks to a point on the vertex at t = 1/2, and beyond.
  const Points shrinks{{{0, 0, 0}, {1, 0, 1}, {0, 1, 1}, {-1, -1, 1}}};
  const Points turned{{{0, 0, 0}, {-1, 0, -1}, {0, -1, -1}, {1, 1, -1}}};
  EXPECT_EQ(first_time(kVf, shrinks, turned), 0.5);
}

TEST(Exact, NothingMoves) {
  EXPECT_EQ(first_time(kVf, kTriangleBelow, kTriangleBelow), 2);
  const Points flat = moved(kTriangleBelow, 0, 0, 0, -1);
  EXPECT_EQ(first_time(kVf, flat, flat), 0);
  EXPECT_EQ(first_time(kVf, flat, all_moved(flat, 7, 7, 7)), 0);
}

TEST(Exact, OnlyUntilTheLatestTimeAskedFor) {
  const Points after = moved(kTriangleBelow, 0, 0, 0, -2);
  EXPECT_EQ(first_time(kVf, kTriangleBelow, after, 0.5), 0.5);
  EXPECT_EQ(first_time(kVf, kTriangleBelow, after, below(0.5)), 2);
}

TEST(Exact, SpreadExponents) {
  // One axis at 2^-1074, one at 2^1000: the answer is that of the same query with axes alike.
  Points t0 = kTriangleBelow;
  Points t1 = moved(kTriangleBelow, 0, 0, 0, -3);
  for (auto* points : {&t0, &t1})
    for (auto& p : *points) {
      p[0] *= 4 * 0x1p-1074;
      p[1] *= 0x1p1000;
    }
  EXPECT_EQ(first_time(kVf, t0, t1), 1.0 / 3);
  // Within one axis: a vertex 2^-1074 inside an edge that is 2^1000 long.
  const Points wide{{{0x1p-1074, 0, 1}, {0, -1, 0}, {0x1p1000, 0, 0}, {0, 1, 0}}};
  EXPECT_EQ(first_time(kVf, wide, moved(wide, 0, 0, 0, -3)), 1.0 / 3);
  Points outside = wide;
  outside[0][0] = -0x1p-1074;
  EXPECT_EQ(first_time(kVf, outside, moved(outside, 0, 0, 0, -3)), 2);
}

TEST(Exact, NamesAndScalesDoNotMatter) {
  std::mt19937_64 random(17);
  int contacts = 0;
  for (int trial = 0; trial < 4000; ++trial) {
    Points t0;
    Points t1;
    for (int k = 0; k < 4; ++k)
      for (int axis = 0; axis < 3; ++axis) {
        t0[k][axis] = static_cast<double>(random() % 9) - 4;
        t1[k][axis] = static_cast<double>(random() % 9) - 4;
      }
    const auto with = [](const Points& p, std::array<int, 4> order, std::array<double, 3> scale) {
      Points q;
      for (int k = 0; k < 4; ++k)
        for (int axis = 0; axis < 3; ++axis) q[k][axis] = p[order[k]][axis] * scale[axis];
      return q;
    };
    const auto time = [&](ContactKind kind, std::array<int, 4> order,
                          std::array<double, 3> scale = {1, 1, 1}) {
      return first_time(kind, with(t0, order, scale), with(t1, order, scale));
    };
    const double vf = time(kVf, {0, 1, 2, 3});
    ASSERT_EQ(time(kVf, {0, 2, 3, 1}), vf) << trial;
    ASSERT_EQ(time(kVf, {0, 3, 2, 1}), vf) << trial;
    ASSERT_EQ(time(kVf, {0, 1, 2, 3}, {-0x1p-1000, 0x1p900, 3}), vf) << trial;
    ASSERT_EQ(first_time(kVf, t1, t0) <= 1, vf <= 1) << trial;
    const double ee = time(kEe, {0, 1, 2, 3});
    ASSERT_EQ(time(kEe, {2, 3, 0, 1}), ee) << trial;
    ASSERT_EQ(time(kEe, {1, 0, 2, 3}), ee) << trial;
    ASSERT_EQ(time(kEe, {3, 2, 1, 0}, {0x1p-1000, 5, -0x1p900}), ee) << trial;
    ASSERT_EQ(first_time(kEe, t1, t0) <= 1, ee <= 1) << trial;
    contacts += (vf <= 1) + (ee <= 1);
  }
  EXPECT_GT(contacts, 400);
}

TEST(Exact, ImpliesTheCertifiedAnswer) {
  std::mt19937_64 random(23);
  const auto uniform = [&] { return static_cast<double>(random() >> 11) * 0x1p-52 - 1; };
  int contacts = 0;
  std::uint64_t exact_tests = 0;
  for (int trial = 0; trial < 100000; ++trial) {
    Points t0;
    Points t1;
    for (int k = 0; k < 4; ++k)
      for (int axis = 0; axis < 3; ++axis) {
        t0[k][axis] = uniform();
        t1[k][axis] = uniform();
      }
    const FeatureCase made(trial % 2 == 0 ? kVf : kEe, t0, t1);
    const Verdict exact = exact_test(made.features(), 1, exact_tests);
    const Verdict certified = certified_test(made.features(), {});
    contacts += exact.contact;
    if (exact.contact) {
      ASSERT_TRUE(certified.contact) << trial;
      ASSERT_LE(certified.toi, exact.toi) << trial;
    } else {
      ASSERT_FALSE(certified.contact && certified.status == ContactStatus::kHit) << trial;
    }
  }
  EXPECT_GT(contacts, 5000);
  EXPECT_LT(exact_tests, 20U);
}

// The hard queries with symbolic truth: every answer true. The times are printed, the first run left out.
TEST(Exact, QuerySets) {
  WARMFRONT_NEED_DATA("queries");
  for (const char* kind_name : {"vertex-face", "edge-edge"}) {
    const auto kind = kind_name[0] == 'v' ? kVf : kEe;
    int queries = 0, misses = 0, inventions = 0;
    std::uint64_t exact_tests = 0;
    double sum_us = 0;
    double slowest_us = 0;
    for (const auto& entry :
         std::filesystem::recursive_directory_iterator(testing::data_root() / "queries")) {
      if (entry.path().extension() != ".csv" || entry.path().parent_path().filename() != kind_name) continue;
      for (const testing::FileQuery& query : testing::read_queries(entry.path())) {
        const FeatureCase made(kind, query.vertices);
        std::uint64_t ignored = 0;
        exact_test(made.features(), 1, ignored);
        const auto begin = std::chrono::steady_clock::now();
        const Verdict verdict = exact_test(made.features(), 1, exact_tests);
        const std::chrono::duration<double, std::micro> us = std::chrono::steady_clock::now() - begin;
        sum_us += us.count();
        slowest_us = std::max(slowest_us, us.count());
        ++queries;
        misses += query.truth && !verdict.contact;
        inventions += !query.truth && verdict.contact;
      }
    }
    std::cout << kind_name << ": " << queries << " queries, " << misses << " missed, " << inventions
              << " invented, " << exact_tests << " by GMP, " << sum_us / queries << " us a query, at most "
              << slowest_us << "\n";
    EXPECT_GT(queries, 0);
    EXPECT_EQ(misses, 0);
    EXPECT_EQ(inventions, 0);
  }
}

TEST(Options, OnlyTheFastTierRefusesASeparation) {
  const Status status = validate({.tier = Tier::kFast, .min_separation = 0.1});
  ASSERT_FALSE(status.ok());
  EXPECT_EQ(status.error().code, ErrorCode::kInvalidArgument);
  EXPECT_NE(status.error().message.find("certified"), std::string::npos);
  EXPECT_TRUE(validate({.tier = Tier::kExact, .min_separation = 0.1}).ok());
}

TEST(Options, ARefusedNumberIsNamedByItsDigits) {
  EXPECT_EQ(validate({.tolerance = -1e-9}).error().message, "tolerance: -1e-09 is not in (0, 1]");
}

}  // namespace
}  // namespace warmfront

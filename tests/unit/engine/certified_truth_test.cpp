// SPDX-License-Identifier: Apache-2.0
// The certified tier on pairs whose truth is known: contacts made exact, motions backwards, and the query
// sets.
#include <gtest/gtest.h>

#include <cmath>
#include <iostream>
#include <random>

#include "engine/elementary/certified.h"
#include "engine/narrow_phase/coplanarity_filter.h"
#include "engine/narrow_phase/feature_block.h"
#include "tests/support/data.h"
#include "tests/support/feature_case.h"
#include "tests/support/query_file.h"
#include "tests/unit/engine/certified_case.h"

namespace warmfront {
namespace {

using Case = testing::CertifiedCase;
using testing::Points;

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

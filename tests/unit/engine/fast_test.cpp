// SPDX-License-Identifier: Apache-2.0
// The fast tier: right where floating point is; prints its errors elsewhere.
#include "engine/elementary/fast.h"

#include <gtest/gtest.h>

#include <iostream>
#include <random>

#include "engine/elementary/certified.h"
#include "tests/support/data.h"
#include "tests/support/feature_case.h"
#include "tests/support/query_file.h"

namespace warmfront {
namespace {

using testing::FeatureCase;
using testing::kTriangleBelow;
using testing::moved;
using testing::Points;

Verdict test(const Points& t0, const Points& t1, ContactKind kind = ContactKind::kVertexFace,
             double latest = 1) {
  return fast_test(FeatureCase(kind, t0, t1).features(), latest);
}

TEST(Fast, VertexThroughFace) {
  const Points below = moved(kTriangleBelow, 0, 0, 0, -2);
  const Verdict verdict = test(kTriangleBelow, below);
  EXPECT_TRUE(verdict.contact);
  EXPECT_EQ(verdict.status, ContactStatus::kHit);
  EXPECT_NEAR(verdict.toi, 0.5, 1e-14);
  EXPECT_FALSE(test(kTriangleBelow, below, ContactKind::kVertexFace, 0.49).contact);
  EXPECT_FALSE(test(moved(kTriangleBelow, 0, 1, 1, 0), moved(below, 0, 1, 1, 0)).contact);
}

TEST(Fast, EdgesCross) {
  const Points above{{{-1, 0, 1}, {1, 0, 1}, {0, -1, 0}, {0, 1, 0}}};
  const Points below = moved(moved(above, 0, 0, 0, -4), 1, 0, 0, -4);
  const Verdict verdict = test(above, below, ContactKind::kEdgeEdge);
  EXPECT_TRUE(verdict.contact);
  EXPECT_NEAR(verdict.toi, 0.25, 1e-14);
  const Points beside = moved(moved(above, 2, 3, 0, 0), 3, 3, 0, 0);
  EXPECT_FALSE(test(beside, moved(moved(beside, 0, 0, 0, -4), 1, 0, 0, -4), ContactKind::kEdgeEdge).contact);
}

TEST(Fast, AgreesWithTheCertifiedTierOnOrdinaryPairs) {
  std::mt19937_64 random(3);
  const auto uniform = [&] { return static_cast<double>(random() >> 11) * 0x1p-52 - 1; };
  int contacts = 0;
  for (int trial = 0; trial < 20000; ++trial) {
    Points t0;
    Points t1;
    for (int k = 0; k < 4; ++k)
      for (int axis = 0; axis < 3; ++axis) {
        t0[k][axis] = uniform();
        t1[k][axis] = uniform();
      }
    const FeatureCase made(trial % 2 == 0 ? ContactKind::kVertexFace : ContactKind::kEdgeEdge, t0, t1);
    const Verdict certified = certified_test(made.features(), {.tolerance = 1e-12});
    const Verdict fast = fast_test(made.features(), 1);
    ASSERT_EQ(fast.contact, certified.contact) << trial;
    if (fast.contact) {
      ASSERT_NEAR(fast.toi, certified.toi, 1e-9) << trial;
    }
    contacts += fast.contact;
  }
  EXPECT_GT(contacts, 1000);
}

// The price of plain floating point on the hard queries: printed, and held to "mostly right".
TEST(Fast, QuerySets) {
  WARMFRONT_NEED_DATA("queries");
  for (const char* kind_name : {"vertex-face", "edge-edge"}) {
    const auto kind = kind_name[0] == 'v' ? ContactKind::kVertexFace : ContactKind::kEdgeEdge;
    int queries = 0, misses = 0, inventions = 0;
    for (const auto& entry :
         std::filesystem::recursive_directory_iterator(testing::data_root() / "queries")) {
      if (entry.path().extension() != ".csv" || entry.path().parent_path().filename() != kind_name) continue;
      for (const testing::FileQuery& query : testing::read_queries(entry.path())) {
        const Verdict verdict = fast_test(FeatureCase(kind, query.vertices).features(), 1);
        ++queries;
        misses += query.truth && !verdict.contact;
        inventions += !query.truth && verdict.contact;
      }
    }
    std::cout << kind_name << ": " << queries << " queries, " << misses << " missed, " << inventions
              << " invented\n";
    EXPECT_LT(misses + inventions, queries / 5);
  }
}

}  // namespace
}  // namespace warmfront

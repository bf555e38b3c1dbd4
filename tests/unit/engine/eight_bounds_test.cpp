// SPDX-License-Identifier: Apache-2.0
// Eight bounds against eight, and the same tests one pair at a time.
#include "engine/bvh/eight_bounds.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <random>
#include <vector>

#include "engine/bounds/overlap.h"
#include "engine/bvh/shared_vertices.h"
#include "tests/unit/engine/random_leaf.h"

namespace warmfront {
namespace {

using testing::all_near;
using testing::Leaf;
using testing::make_endless;
using testing::number;
using testing::random_leaf;
using testing::random_width;

template <class Bounds>
bool share_vertex(const Leaf<Bounds>& a, std::uint32_t i, const Leaf<Bounds>& b, std::uint32_t j) {
  for (const auto& p : a.corners.vertex)
    for (const auto& q : b.corners.vertex)
      if (p[i] == q[j]) return true;
  return false;
}

template <class Bounds>
class EightBoundsTest : public ::testing::Test {};
using Kinds = ::testing::Types<Aabb, KDop18>;
TYPED_TEST_SUITE(EightBoundsTest, Kinds);

// Those that share a vertex, as SharedVertices has them.
template <class Bounds>
std::uint64_t sharing(const Leaf<Bounds>& a, const Leaf<Bounds>& b, bool same) {
  std::uint64_t pairs = 0;
  for (std::uint32_t i = 0; i < a.count(); ++i) {
    for (std::uint32_t j = 0; j < b.count(); ++j) {
      if (!(same && i == j) && share_vertex(a, i, b, j)) pairs |= std::uint64_t{1} << (8 * i + j);
    }
  }
  return pairs;
}

template <class Bounds>
EightOverlaps overlaps_of(const Leaf<Bounds>& a, const Leaf<Bounds>& b, bool same, std::uint64_t without,
                          const Width& width = {}) {
  const GridPair<Bounds> between = grid_pair(a.grid, b.grid, width);
  const OneOfLeaf whole_b = OneOfLeaf::of(b.grid);
  Rebased<Bounds> over;
  rebase(a.block, between, over);
  return primitive_overlaps(over, b.block, between, same ? nullptr : &whole_b, without, 1);
}

// How far apart two are at the end of the step, whatever the width.
template <class Bounds>
float bare_gap(const Bounds& a, const Bounds& b) {
  float widest = -std::numeric_limits<float>::infinity();
  for (int k = 0; k < Bounds::kAxes; ++k) {
    const int lower = Bounds::kEnd + k;
    const int upper = lower + Bounds::kAxes;
    const float gap = std::max(a.lane[lower] + b.lane[upper], a.lane[upper] + b.lane[lower]);
    widest = std::max(widest, k < 3 ? gap : gap / 2);
  }
  return widest;
}

TYPED_TEST(EightBoundsTest, SharingPairsAreFound) {
  std::mt19937 random(11);
  for (int trial = 0; trial < 500; ++trial) {
    const auto a = random_leaf<TypeParam>(random);
    const auto b = random_leaf<TypeParam>(random);
    const std::uint64_t pairs = ~no_pairs(a.count(), b.count(), false);
    ASSERT_EQ(sharing_pairs(a.corners, b.corners) & pairs, sharing(a, b, false)) << trial;
    const std::uint64_t own = ~no_pairs(a.count(), a.count(), true);
    ASSERT_EQ(sharing_pairs(a.corners, a.corners) & own, sharing(a, a, true) & own) << trial;
    if (sharing(a, b, false) == 0) {
      ASSERT_EQ(sharing_pairs(a.corners, b.corners), 0U) << "of empty slots, trial " << trial;
    }
    ASSERT_EQ(transposed(sharing(a, b, false)), sharing(b, a, false)) << trial;
  }
}

// A bit for each vertex, the first that could stand for it: of corners drawn from few vertices to many.
TEST(FirstCorners, StandForEachVertexOnce) {
  std::mt19937 random(5);
  for (std::uint32_t trial = 0; trial < 2000; ++trial) {
    const std::uint32_t vertices = 1 + trial % 40;
    EightCorners corners;
    std::map<std::uint32_t, std::uint32_t> first;  // bit, by vertex
    for (std::uint32_t k = 0; k < 3; ++k) {
      for (std::uint32_t i = 0; i < 8; ++i) {
        corners.vertex[k][i] = 0xFFFFFFF0U + static_cast<std::uint32_t>(random()) % vertices;
        first.emplace(corners.vertex[k][i], 8 * k + i);
      }
    }
    std::uint32_t expected = 0;
    for (const auto& [vertex, bit] : first) expected |= 1U << bit;
    ASSERT_EQ(first_corners(corners), expected) << trial;
  }
}

TYPED_TEST(EightBoundsTest, EqualsPairByPair) {
  std::mt19937 random(7);
  std::uint64_t met = 0;
  std::uint64_t sure = 0;
  std::uint64_t apart = 0;
  for (int trial = 0; trial < 8000; ++trial) {
    const auto a = random_leaf<TypeParam>(random);
    const bool same = trial % 4 == 0;
    const auto b = same ? a : random_leaf<TypeParam>(random);
    const Width width = random_width(random);
    float nearest = std::numeric_limits<float>::max();
    const EightOverlaps overlaps =
        overlaps_of(a, b, same, no_pairs(a.count(), b.count(), same) | sharing(a, b, same), width);
    for (std::uint32_t i = 0; i < 8; ++i) {
      for (std::uint32_t j = 0; j < 8; ++j) {
        const bool pair = i < a.count() && j < b.count() && (!same || i < j);
        const bool overlapping = pair && overlap(a.bounds[i], b.bounds[j], width);
        met += overlapping;
        const bool adjacent = overlapping && share_vertex(a, i, b, j);
        if (pair && !share_vertex(a, i, b, j))
          nearest = std::min(nearest, bare_gap(a.bounds[i], b.bounds[j]));
        // Overlaps are found; a disjoint pair that is reported must be marked unsure.
        const bool found = ((overlaps.to_test >> (8 * j + i)) & 1U) != 0;
        const bool unsure = ((overlaps.unsure >> (8 * j + i)) & 1U) != 0;
        sure += found && !unsure;
        ASSERT_TRUE(overlapping && !adjacent ? found : !found || (unsure && !share_vertex(a, i, b, j)))
            << trial << ": " << i << ", " << j;
        ASSERT_TRUE(found || !unsure);
      }
    }
    // A budget is granted by it, for questions of any width.
    EXPECT_LE(overlaps.gap, nearest) << trial;
    if (overlaps.to_test == 0) {
      // Rows that are apart from the leaf as a whole count with their gap to that.
      EXPECT_GT(overlaps.gap, 0) << trial;
      ++apart;
    }
  }
  EXPECT_GT(met, 1000U);
  EXPECT_GT(sure, 1000U);
  EXPECT_GT(apart, 30U);
}

// For two blocks that share no vertex nothing is excluded: empty slots repeat the first.
TYPED_TEST(EightBoundsTest, EmptySlotsChangeNothing) {
  std::mt19937 random(12);
  int smaller = 0;
  for (int trial = 0; trial < 2000; ++trial) {
    const auto a = random_leaf<TypeParam>(random);
    const auto b = random_leaf<TypeParam>(random);
    const EightOverlaps expected = overlaps_of(a, b, false, no_pairs(a.count(), b.count(), false));
    const EightOverlaps overlaps = overlaps_of(a, b, false, 0);
    const std::uint64_t none = no_pairs(b.count(), a.count(), false);
    ASSERT_EQ(overlaps.to_test & ~none, expected.to_test) << trial;
    ASSERT_EQ(overlaps.unsure & ~none, expected.unsure) << trial;
    ASSERT_EQ(overlaps.gap, expected.gap) << trial;
    smaller += none != 0;
  }
  EXPECT_GT(smaller, 1000);
}

// The limits of the numbers, and of the offset between two leaves, must not make disjoint neighbours overlap,
// for any sizes of the leaves within a unit's range.
TYPED_TEST(EightBoundsTest, LeavesBesideEachOtherAreApart) {
  std::mt19937 random(10);
  for (int trial = 0; trial < 4000; ++trial) {
    auto a = random_leaf<TypeParam>(random);
    auto b = random_leaf<TypeParam>(random);
    const float scale = 1 + static_cast<float>(random() % 1024) / 1024;
    const Width width = trial % 2 == 0 ? Width() : random_width(random);
    const float beside = 0.01F + static_cast<float>(random() % 512) / 512;
    // Along one axis only: along the others they may overlap.
    for (const int end : {0, TypeParam::kEnd}) {
      const int k = end + trial % TypeParam::kAxes;
      const float shift = -a.node.lane[k + TypeParam::kAxes] - b.node.lane[k] + beside +
                          width.along(trial % TypeParam::kAxes);
      for (auto& bounds : b.bounds) {
        bounds.lane[k] += shift;
        bounds.lane[k + TypeParam::kAxes] -= shift;
      }
    }
    for (auto* leaf : {&a, &b}) {
      leaf->node = TypeParam::empty();
      for (auto& bounds : leaf->bounds) {
        for (float& lane : bounds.lane) lane *= scale;
        leaf->node.merge(bounds);
      }
      number(*leaf);
    }
    const EightOverlaps overlaps = block_overlaps(a.block, b.block, {a.count(), b.count(), false},
                                                  grid_pair(a.grid, b.grid, width), OneOfLeaf::of(b.grid), 1);
    ASSERT_EQ(overlaps.to_test & ~overlaps.unsure, 0U) << trial;
  }
}

TYPED_TEST(EightBoundsTest, NothingIsApartFromALeafWhoseBoundsAreInfinite) {
  std::mt19937 random(9);
  for (int trial = 0; trial < 200; ++trial) {
    auto a = random_leaf<TypeParam>(random);
    auto b = random_leaf<TypeParam>(random);
    make_endless(trial % 2 == 0 ? a : b, trial % 4 < 2 ? 0 : 1);
    const EightOverlaps overlaps = block_overlaps(a.block, b.block, {a.count(), b.count(), false},
                                                  grid_pair(a.grid, b.grid, random_width(random)), OneOfLeaf::of(b.grid), 1);
    ASSERT_TRUE(all_near(overlaps, a, b)) << trial;
  }
}

TYPED_TEST(EightBoundsTest, BlocksEqualPairByPair) {
  std::mt19937 random(8);
  int met = 0;
  int beside = 0;  // they nearly overlap
  for (int trial = 0; trial < 2000; ++trial) {
    const auto a = random_leaf<TypeParam>(random);
    const bool same = trial % 4 == 0;
    const auto b = same ? a : random_leaf<TypeParam>(random);
    const Width width = trial % 2 == 0 ? Width() : random_width(random);
    float nearest = std::numeric_limits<float>::max();
    const GridPair<TypeParam> between = grid_pair(a.grid, b.grid, width);
    const EightOverlaps overlaps =
        block_overlaps(a.block, b.block, {a.count(), b.count(), same}, between, OneOfLeaf::of(b.grid), 1);
    for (std::uint32_t i = 0; i < 8; ++i) {
      for (std::uint32_t j = 0; j < 8; ++j) {
        const bool pair = i < a.count() && j < b.count() && (!same || i <= j);
        const bool overlapping = pair && ((same && i == j) || overlap(a.bounds[i], b.bounds[j], width));
        met += overlapping;
        const bool found = ((overlaps.to_test >> (8 * j + i)) & 1U) != 0;
        if (pair && !found) nearest = std::min(nearest, bare_gap(a.bounds[i], b.bounds[j]));
        ASSERT_TRUE(overlapping ? found : !found || pair) << trial << ": " << i << ", " << j;
        beside += found && !overlapping;
      }
    }
    EXPECT_GT(overlaps.gap, 0) << trial;
    EXPECT_LE(overlaps.gap, nearest) << trial;
  }
  EXPECT_GT(met, 1000);
  EXPECT_LT(beside, met / 50);
}

}  // namespace
}  // namespace warmfront

// SPDX-License-Identifier: Apache-2.0
// Leaf blocks against the same tests one pair at a time.
#include "engine/bvh/leaf_block.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <random>
#include <vector>

#include "engine/bounds/overlap.h"

namespace warmfront {
namespace {

template <class Bounds>
struct Leaf {
  std::vector<Bounds> bounds;
  Bounds node = Bounds::empty();
  LeafBlock<Bounds> block{};
};

// Small boxes on a small grid, so that many touch; few vertices, so that many are shared.
template <class Bounds>
Leaf<Bounds> random_leaf(std::mt19937& random) {
  Leaf<Bounds> leaf;
  leaf.block.count = 1 + random() % 8;
  for (std::uint32_t i = 0; i < leaf.block.count; ++i) {
    Bounds bounds;
    for (const int end : {0, Bounds::kEnd}) {
      for (int axis = end; axis < end + Bounds::kAxes; ++axis) {
        const auto lower = static_cast<float>(random() % 12);
        bounds.lane[axis] = lower;
        bounds.lane[axis + Bounds::kAxes] = -(lower + static_cast<float>(random() % 8));
      }
    }
    if (random() % 16 == 0) bounds.lane.fill(-std::numeric_limits<float>::infinity());  // holds everything
    leaf.bounds.push_back(bounds);
    leaf.node.merge(bounds);
    for (std::size_t k = 0; k < bounds.lane.size(); ++k) leaf.block.lane[k][i] = bounds.lane[k];
    for (auto& corner : leaf.block.vertex) corner[i] = random() % 24;
  }
  return leaf;
}

template <class Bounds>
bool share_vertex(const Leaf<Bounds>& a, std::uint32_t i, const Leaf<Bounds>& b, std::uint32_t j) {
  for (const auto& p : a.block.vertex)
    for (const auto& q : b.block.vertex)
      if (p[i] == q[j]) return true;
  return false;
}

template <class Bounds>
class LeafBlockTest : public ::testing::Test {};
using Kinds = ::testing::Types<Aabb, KDop18>;
TYPED_TEST_SUITE(LeafBlockTest, Kinds);

TYPED_TEST(LeafBlockTest, EqualsPairByPair) {
  std::mt19937 random(7);
  std::uint64_t met = 0;
  std::uint64_t apart = 0;
  for (int trial = 0; trial < 2000; ++trial) {
    const auto a = random_leaf<TypeParam>(random);
    const bool same = trial % 4 == 0;
    const auto b = same ? a : random_leaf<TypeParam>(random);
    float nearest = std::numeric_limits<float>::max();
    bool any_adjacent = false;
    const EightOverlaps overlaps = primitive_overlaps(a.block, b.block, LanesOfOne::of(b.node), same, 1);
    for (std::uint32_t i = 0; i < 8; ++i) {
      for (std::uint32_t j = 0; j < 8; ++j) {
        const bool pair = i < a.block.count && j < b.block.count && (!same || i < j);
        const bool overlapping = pair && overlap(a.bounds[i], b.bounds[j]);
        met += overlapping;
        const bool adjacent = overlapping && share_vertex(a, i, b, j);
        any_adjacent |= adjacent;
        if (pair && !share_vertex(a, i, b, j))
          nearest = std::min(nearest, separation(a.bounds[i], b.bounds[j]));
        ASSERT_EQ((overlaps.to_test >> (8 * j + i)) & 1U, overlapping && !adjacent)
            << trial << ": " << i << ", " << j;
      }
    }
    EXPECT_EQ(overlaps.adjacent, any_adjacent) << trial;
    if (overlaps.to_test == 0) {
      // Rows that are apart from the leaf as a whole count with their gap to that.
      EXPECT_GT(overlaps.gap, 0) << trial;
      EXPECT_LE(overlaps.gap, nearest) << trial;
      ++apart;
    }
  }
  EXPECT_GT(met, 1000U);
  EXPECT_GT(apart, 30U);
}

TYPED_TEST(LeafBlockTest, BlocksEqualPairByPair) {
  std::mt19937 random(8);
  int met = 0;
  for (int trial = 0; trial < 2000; ++trial) {
    const auto a = random_leaf<TypeParam>(random);
    const bool same = trial % 4 == 0;
    const auto b = same ? a : random_leaf<TypeParam>(random);
    float nearest = std::numeric_limits<float>::max();
    const EightOverlaps overlaps = block_overlaps(a.block, b.block, LanesOfOne::of(b.node), same, 1);
    for (std::uint32_t i = 0; i < 8; ++i) {
      for (std::uint32_t j = 0; j < 8; ++j) {
        const bool pair = i < a.block.count && j < b.block.count && (!same || i <= j);
        const bool overlapping = pair && ((same && i == j) || overlap(a.bounds[i], b.bounds[j]));
        met += overlapping;
        if (pair && !overlapping) nearest = std::min(nearest, separation(a.bounds[i], b.bounds[j]));
        ASSERT_EQ((overlaps.to_test >> (8 * j + i)) & 1U, overlapping) << trial << ": " << i << ", " << j;
      }
    }
    EXPECT_GT(overlaps.gap, 0) << trial;
    EXPECT_LE(overlaps.gap, nearest) << trial;
  }
  EXPECT_GT(met, 1000);
}

}  // namespace
}  // namespace warmfront

// SPDX-License-Identifier: Apache-2.0
// An incrementally refit hierarchy against one whose bounds are recomputed.
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <random>

#include "tests/support/hierarchy.h"
#include "tests/support/scenes.h"

namespace warmfront::testing {
namespace {

template <class Bounds>
class RefitTest : public ::testing::Test {};
using Kinds = ::testing::Types<Aabb, KDop18>;
TYPED_TEST_SUITE(RefitTest, Kinds);

template <class Bounds>
void expect_same_eight(const EightBounds<Bounds>& refit, const LeafGrid<Bounds>& of_refit,
                       const EightBounds<Bounds>& anew, const LeafGrid<Bounds>& of_anew, const char* what) {
  for (std::size_t t = 0; t < 2; ++t) {
    for (std::size_t axis = 0; axis < Bounds::kAxes; ++axis) {
      for (std::uint32_t n = 0; n < 2 * anew.kSlots; ++n)
        ASSERT_EQ(row_of(refit, of_refit.begin_at_1, t, axis)[n],
                  row_of(anew, of_anew.begin_at_1, t, axis)[n])
            << what << ", end " << t << ", axis " << axis << ", number " << n;
    }
  }
}

template <class Bounds>
void expect_same_bounds(const Bvh<Bounds>& refit, const Bvh<Bounds>& anew) {
  ASSERT_EQ(refit.nodes.size(), anew.nodes.size());
  for (std::size_t n = 0; n < anew.nodes.size(); ++n) ASSERT_EQ(refit.nodes[n].lane, anew.nodes[n].lane) << n;
  for (std::size_t l = 0; l < anew.leaves.grids.size(); ++l) {
    ASSERT_TRUE(refit.leaves.grids[l] == anew.leaves.grids[l]) << l;
    ASSERT_EQ(refit.leaves.blocks_of[l], anew.leaves.blocks_of[l]);
    const auto [first, end] = anew.leaves.blocks_of[l];
    for (std::uint32_t b = number_of(first); b < number_of(end); ++b)
      expect_same_eight<Bounds>(refit.leaves.blocks[b], refit.leaves.grids[l], anew.leaves.blocks[b],
                                anew.leaves.grids[l], "block");
    if (!anew.leaves.wide.empty())
      expect_same_eight<Bounds>(refit.leaves.wide[l], refit.leaves.grids[l], anew.leaves.wide[l],
                                anew.leaves.grids[l], "wide leaf");
  }
}

// A number counts units from its leaf's origin, from below, by less than one and what float32 rounds.
template <class Bounds>
void expect_rounded_outward(const LeafGrid<Bounds>& grid, const OneOfLeaf& numbers, const Bounds& bounds) {
  for (std::size_t t = 0; t < 2; ++t) {
    ASSERT_FALSE(grid.end[t].none());
    const double unit = std::ldexp(1.0, grid.end[t].exponent);
    for (std::size_t k = 0; k < grid.kAxes; ++k) {
      const double origin = grid.end[t].origin[k];
      const float* lane = &bounds.lane[t * Bounds::kEnd + k];
      const double lower = (lane[0] - origin) / unit - numbers(t, k)[0];
      const double upper = (lane[grid.kAxes] + origin) / unit - numbers(t, k)[1];
      ASSERT_GE(lower, 0);
      ASSERT_GE(upper, 0);
      ASSERT_LE(lower, 1.01);
      ASSERT_LE(upper, 1.01);
      ASSERT_LE(std::abs(numbers(t, k)[0]), grid.kReach + 1);
      ASSERT_LE(std::abs(numbers(t, k)[1]), grid.kReach + 1);
    }
  }
}

// Of each leaf, its blocks, and its primitives.
template <class Bounds>
void expect_rounded_outward(const Hierarchy<Bounds>& hierarchy) {
  const Bvh<Bounds>& bvh = hierarchy.bvh;
  for (std::size_t l = 0; l < bvh.leaves.grids.size(); ++l) {
    const NodeId leaf = bvh.shape.node_of(LeafId{static_cast<std::uint32_t>(l)});
    expect_rounded_outward(bvh.leaves.grids[l], OneOfLeaf::of(bvh.leaves.grids[l]),
                           bvh.nodes[number_of(leaf)]);
    const std::uint32_t begin_at_1 = bvh.leaves.grids[l].begin_at_1;
    const auto [first, end] = bvh.leaves.blocks_of[l];
    for (BlockId b = first; b < end; ++b) {
      Bounds sum = Bounds::empty();
      for (std::uint32_t i = 0; i < bvh.shape.size_of_block(b); ++i) {
        Bounds bounds = Bounds::empty();
        for (const auto& corner : bvh.leaves.corners[number_of(b)].vertex)
          bounds.merge(narrow<Bounds>(bounds_of(hierarchy.vertex_bounds()[corner[i]])));
        expect_rounded_outward(bvh.leaves.grids[l],
                               OneOfLeaf::of(bvh.leaves.blocks[number_of(b)], begin_at_1, i), bounds);
        sum.merge(bounds);
      }
      if (!bvh.leaves.wide.empty())
        expect_rounded_outward(bvh.leaves.grids[l], OneOfLeaf::of(bvh.leaves.wide[l], begin_at_1, b - first),
                               sum);
      if (::testing::Test::HasFatalFailure()) return;
    }
  }
}

TYPED_TEST(RefitTest, RefitBoundsAreTheRebuiltOnesBitForBit) {
  std::mt19937_64 random(7);
  for (int world = 0; world < 40; ++world) {
    RandomScene scene = random_scene(random);
    const std::uint32_t leaf_size = 1U << (random() % 7);
    Hierarchy<TypeParam> hierarchy(scene.scene, scene.positions, leaf_size);
    for (int step = 0; step < 12; ++step) {
      // Some steps are stationary as a whole: then everything comes to a stop.
      if (random() % 4 != 0) scene.positions = random_motion(random, *scene.scene, scene.positions);
      hierarchy.step(scene.positions);
      expect_same_bounds(hierarchy.bvh, hierarchy.anew());
      expect_rounded_outward(hierarchy);
      ASSERT_FALSE(this->HasFatalFailure()) << "world " << world << ", step " << step;
    }
  }
}

// Once each, when all of it is of this step.
TYPED_TEST(RefitTest, TellsOfEverySubtreeThatChanged) {
  constexpr std::uint32_t kSide = 40;
  constexpr std::uint32_t kVertices = (kSide + 1) * (kSide + 1);
  const auto scene = make_scene(kVertices, grid(kSide));
  std::vector<double> positions;
  for (std::uint32_t v = 0; v < kVertices; ++v)
    positions.insert(positions.end(), {v / (kSide + 1) * 0.1, v % (kSide + 1) * 0.1, 0});
  Hierarchy<TypeParam> hierarchy(scene, positions, 32);
  const TreeShape& shape = hierarchy.bvh.shape;
  ASSERT_GE(shape.subtree_count(), 8U);
  std::vector<std::size_t> told_in_step;
  for (const std::size_t moving : {positions.size(), positions.size() / 3, std::size_t{30}, std::size_t{0}}) {
    std::vector<std::atomic<int>> told(shape.subtree_count());
    std::vector<std::vector<TypeParam>> seen(shape.subtree_count());  // of leaves, as they were told of
    hierarchy.then = [&](std::uint32_t subtree) {
      ++told[subtree];
      for (NodeId leaf = shape.first_leaf(); leaf < shape.end_node(); ++leaf) {
        if (shape.subtree_of(leaf) == subtree) seen[subtree].push_back(hierarchy.bvh.nodes[number_of(leaf)]);
      }
    };
    for (std::size_t k = 0; k < moving; ++k) positions[k] += 0.01;
    hierarchy.step(positions);
    std::vector<bool> changed(shape.subtree_count());
    std::vector<std::size_t> next(shape.subtree_count());
    for (NodeId leaf = shape.first_leaf(); leaf < shape.end_node(); ++leaf) {
      const std::uint32_t subtree = shape.subtree_of(leaf);
      if ((hierarchy.bvh.motion.states[number_of(leaf)] & kChanged) != 0) changed[subtree] = true;
      if (told[subtree] > 0) {
        EXPECT_EQ(seen[subtree][next[subtree]++].lane, hierarchy.bvh.nodes[number_of(leaf)].lane)
            << number_of(leaf);
      }
    }
    for (std::uint32_t subtree = 0; subtree < told.size(); ++subtree)
      EXPECT_EQ(told[subtree], changed[subtree] ? 1 : 0) << subtree;
    told_in_step.push_back(static_cast<std::size_t>(std::ranges::count(changed, true)));
  }
  EXPECT_EQ(told_in_step[0], shape.subtree_count());
  EXPECT_LT(told_in_step[2], told_in_step[0]);
  EXPECT_GT(told_in_step[2], 0U);
}

}  // namespace
}  // namespace warmfront::testing

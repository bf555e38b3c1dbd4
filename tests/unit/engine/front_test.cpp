// SPDX-License-Identifier: Apache-2.0
#include "engine/front/front.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "engine/front/descend.h"
#include "engine/workers.h"
#include "tests/support/hierarchy.h"
#include "tests/support/scenes.h"

namespace warmfront {
namespace {

// Every pair that traversal from the root can reach, with the path it came by.
void reach(const Bvtt& bvtt, const NodePair& pair, int& visited) {
  ++visited;
  if (bvtt.is_leaf(pair)) return;
  bool first = true;
  bvtt.for_children(pair, [&](const NodePair& child) {
    if (bvtt.self()) {
      EXPECT_LE(child.a, child.b);
    }
    EXPECT_EQ(bvtt.parent(child), pair) << number_of(child.a) << " " << number_of(child.b);
    EXPECT_EQ(bvtt.is_first_child(child), first) << number_of(child.a) << " " << number_of(child.b);
    first = false;
    reach(bvtt, child, visited);
  });
}

TEST(Bvtt, ParentUndoesOpeningOfAPartAgainstItself) {
  for (const std::uint32_t leaves : {1U, 2U, 3U, 5U, 11U, 64U, 100U}) {
    const TreeShape shape(leaves, 1);
    int visited = 0;
    reach(Bvtt(shape, shape, true), Bvtt::root(), visited);
    EXPECT_GE(visited, leaves * (leaves - 1) / 2);
  }
}

TEST(Bvtt, ParentUndoesOpeningOfTwoParts) {
  for (const std::uint32_t a : {1U, 2U, 3U, 11U, 64U, 99U}) {
    for (const std::uint32_t b : {1U, 4U, 5U, 64U}) {
      const TreeShape shape_a(a, 1);
      const TreeShape shape_b(b, 1);
      int visited = 0;
      reach(Bvtt(shape_a, shape_b, false), Bvtt::root(), visited);
      EXPECT_EQ(visited, 2 * a * b - 1) << "a tree with a leaf for each pair of leaves";
    }
  }
}

// The leaves below a node, from left to right.
void gather_leaves(const TreeShape& shape, NodeId node, std::vector<NodeId>& leaves) {
  ASSERT_LT(node, shape.end_node());
  if (shape.is_leaf(node)) return leaves.push_back(node);
  gather_leaves(shape, TreeShape::left(node), leaves);
  gather_leaves(shape, TreeShape::right(node), leaves);
}

TEST(TreeShape, LeavesPartitionThePrimitivesAndAreFull) {
  for (const std::uint32_t primitives : {1U, 2U, 3U, 7U, 8U, 9U, 80U, 100U, 4097U, 92230U}) {
    for (const std::uint32_t leaf_size : {1U, 2U, 4U, 8U, 16U, 64U}) {
      const TreeShape shape(primitives, leaf_size);
      EXPECT_EQ(shape.leaf_count(), (primitives + leaf_size - 1) / leaf_size);
      for (BlockId block{0}; block < shape.end_block(); ++block) {
        ASSERT_LT(shape.begin_of_block(block), shape.begin_of_block(block + 1)) << "empty block";
        ASSERT_LE(shape.begin_of_block(block + 1) - shape.begin_of_block(block), std::min(leaf_size, 8U));
      }
      std::vector<NodeId> leaves;
      gather_leaves(shape, kRoot, leaves);
      ASSERT_EQ(leaves.size(), shape.leaf_count());
      std::uint32_t next = 0;
      for (const NodeId leaf : leaves) {
        ASSERT_EQ(shape.begin(leaf), next);
        next = shape.end(leaf);
        ASSERT_GT(next, shape.begin(leaf)) << "empty leaf";
        ASSERT_LE(next - shape.begin(leaf), leaf_size);
        ASSERT_LE(shape.end_block(leaf) - shape.first_block(leaf), std::max(1U, leaf_size / 8));
      }
      ASSERT_EQ(next, primitives);
      for (NodeId node = kRoot; node < shape.first_leaf(); ++node) {
        EXPECT_EQ(shape.begin(node), shape.begin(TreeShape::left(node)));
        EXPECT_EQ(shape.end(TreeShape::left(node)), shape.begin(TreeShape::right(node)));
        EXPECT_EQ(shape.end(node), shape.end(TreeShape::right(node)));
      }
    }
  }
}

// Every leaf is in one subtree, whole; a larger hierarchy has more of them, until they are 256.
TEST(TreeShape, SubtreesPartitionTheLeaves) {
  std::uint32_t most = 0;
  for (const std::uint32_t primitives :
       {1U, 2U, 700U, 1024U, 1025U, 4344U, 9800U, 49000U, 92230U, 1475680U}) {
    for (const std::uint32_t leaf_size : {1U, 8U, 64U}) {
      const TreeShape shape(primitives, leaf_size);
      ASSERT_EQ(shape.subtree_count() == 1, primitives <= 1024);
      most = std::max(most, shape.subtree_count());
      std::vector<NodeId> leaves;
      const NodeId first_root{shape.subtree_count() - 1};  // counted by levels
      for (std::uint32_t subtree = 0; subtree < shape.subtree_count(); ++subtree) {
        const std::size_t begin = leaves.size();
        gather_leaves(shape, first_root + subtree, leaves);
        ASSERT_EQ(shape.subtree_of(first_root + subtree), subtree);
        for (std::size_t i = begin; i < leaves.size(); ++i) ASSERT_EQ(shape.subtree_of(leaves[i]), subtree);
      }
      ASSERT_EQ(leaves.size(), shape.leaf_count());
      EXPECT_LE(shape.subtree_count(), std::max(16U, primitives / 512));
    }
  }
  EXPECT_EQ(most, 256U);
}

template <class Bounds>
class FrontOf : public ::testing::Test {};
using BothBounds = ::testing::Types<Aabb, KDop18>;
TYPED_TEST_SUITE(FrontOf, BothBounds);

// The strongest test there is: a front updated over any history is the one built from scratch.
TYPED_TEST(FrontOf, UpdateEqualsBuild) {
  Workers workers(2);
  std::uint64_t sprouted = 0;
  std::uint64_t pruned = 0;
  for (std::uint64_t seed = 0; seed < 60; ++seed) {
    std::mt19937_64 random(seed);
    // Several random scenes side by side make a hierarchy with something in it.
    auto [scene, positions] = testing::random_scene(random);
    if (seed % 3 == 0) {
      scene = testing::make_scene(21 * 21, testing::grid(20));
      positions.assign(3 * 21 * 21, 0);
      for (int i = 0; i < 21 * 21; ++i) {
        positions[3 * i] = i / 21;
        positions[3 * i + 1] = i % 21;
      }
    }
    testing::Hierarchy<TypeParam> hierarchy(scene, positions, 1U << (seed % 4));
    Front<TypeParam> warm;
    testing::CountingSinks sinks;
    workers.run([&] { testing::build(warm, hierarchy, sinks); });
    for (int step = 0; step < 8; ++step) {
      positions = testing::random_motion(random, *scene, positions);
      hierarchy.step(positions);
      Front<TypeParam> cold;
      workers.run([&] {
        sinks.count = 0;
        testing::advance(warm, hierarchy, sinks);
        const std::uint64_t from_warm = sinks.count.exchange(0);
        testing::build(cold, hierarchy, sinks);
        EXPECT_EQ(from_warm, sinks.count.load());
      });
      ASSERT_EQ(warm.pairs(), cold.pairs()) << "seed " << seed << " step " << step;
      EXPECT_EQ(warm.counts().bytes, warm.pair_bytes());
      sprouted += warm.counts().sprouted;
      pruned += warm.counts().pruned;
    }
  }
  EXPECT_GT(sprouted, 100U);
  EXPECT_GT(pruned, 100U);
}

// Sprouting alone keeps a valid front: the same leaf pairs result, from a longer list.
TYPED_TEST(FrontOf, SproutOnlyFindsTheSameLeafPairs) {
  Workers workers(1);
  std::mt19937_64 random(5);
  // No structured binding: clang 14 does not let lambdas name one.
  const auto drawn = testing::random_scene(random);
  const auto& scene = drawn.scene;
  auto positions = drawn.positions;
  testing::Hierarchy<TypeParam> hierarchy(scene, positions, 1);
  Front<TypeParam> front;
  testing::CountingSinks sinks;
  workers.run([&] {
    testing::build(front, hierarchy, sinks);
    for (int step = 0; step < 10; ++step) {
      const std::size_t before = front.size();
      positions = testing::random_motion(random, *scene, positions);
      hierarchy.step(positions);
      sinks.count = 0;
      testing::advance(front, hierarchy, sinks, {.prune = false});
      EXPECT_GE(front.size(), before);
      const std::uint64_t from_front = sinks.count.exchange(0);
      Front<TypeParam> none;
      testing::build(none, hierarchy, sinks, {.record = false});
      EXPECT_TRUE(none.empty());
      EXPECT_EQ(from_front, sinks.count.load());
    }
  });
}

TYPED_TEST(FrontOf, AboveTheCapItIsDroppedButLeafPairsAreNot) {
  Workers workers(2);
  const auto scene = testing::make_scene(41 * 41, testing::grid(40));
  std::vector<double> positions(3 * 41 * 41);
  for (int i = 0; i < 41 * 41; ++i) positions[3 * i] = i % 41;  // all on one line: everything is near
  testing::Hierarchy<TypeParam> hierarchy(scene, positions, 2);
  testing::CountingSinks sinks;
  workers.run([&] {
    Front<TypeParam> whole;
    testing::build(whole, hierarchy, sinks);
    const std::uint64_t all = sinks.count.exchange(0);
    Front<TypeParam> capped;
    testing::build(capped, hierarchy, sinks, {.max_bytes = sizeof(FrontPair) * (whole.size() - 1)});
    EXPECT_TRUE(capped.overflowed());
    EXPECT_TRUE(capped.empty());
    EXPECT_EQ(sinks.count.exchange(0), all);
    testing::build(capped, hierarchy, sinks, {.max_bytes = sizeof(FrontPair) * whole.size()});
    EXPECT_FALSE(capped.overflowed());
    EXPECT_EQ(capped.size(), whole.size());
  });
}

}  // namespace
}  // namespace warmfront

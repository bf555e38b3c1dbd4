// SPDX-License-Identifier: Apache-2.0
// Neighbouring blocks: all are listed, and each is tested when its budget is spent. crumpled_test.cpp looks
// for the contacts among them.
#include "engine/front/neighbours.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cstdint>
#include <limits>
#include <memory>
#include <random>
#include <set>
#include <string>
#include <tuple>
#include <type_traits>
#include <vector>

#include "engine/bounds/overlap.h"
#include "tests/support/hierarchy.h"
#include "tests/support/scenes.h"
#include "tests/support/shaken_sheet.h"

namespace warmfront {
namespace {

template <class Bounds>
struct Sheet {
  std::shared_ptr<const Scene> scene =
      testing::make_scene(testing::kSheetVertices, testing::grid(testing::kSheetCells));
  testing::Hierarchy<Bounds> hierarchy{scene, testing::flat_sheet(), 32};
};

TEST(Neighbours, AreListedOnceByTheirLeaves) {
  const Sheet<KDop18> sheet;
  const Bvh<KDop18>& tree = sheet.hierarchy.bvh;
  const auto blocks_of = [&](LeafId leaf) { return tree.leaves.blocks_of[number_of(leaf)]; };
  ASSERT_GE(tree.shape.subtree_count(), 4U);
  std::set<std::tuple<BlockId, BlockId>> listed;
  const std::vector<NeighbourChunk> chunks = list_neighbours(tree);
  EXPECT_GT(chunks.size(), tree.shape.subtree_count()) << "of two subtrees, too";
  for (std::size_t c = 0; c < chunks.size(); ++c) {
    const NeighbourChunk& chunk = chunks[c];
    EXPECT_TRUE(chunk.may_have_contacts);
    ASSERT_FALSE(chunk.leaves.empty());
    EXPECT_EQ(chunk.leaves.back().end, chunk.pairs.size());
    std::uint32_t n = 0;
    for (const auto& leaves : chunk.leaves) {
      ASSERT_LT(n, leaves.end);
      const std::uint32_t of_a = tree.shape.subtree_of(tree.shape.node_of(leaves.a));
      const std::uint32_t of_b = tree.shape.subtree_of(tree.shape.node_of(leaves.b));
      if (c < tree.shape.subtree_count())
        EXPECT_TRUE(of_a == c && of_b == c) << c;
      else
        EXPECT_NE(of_a, of_b);
      for (; n < leaves.end; ++n) {
        const NeighbourPair& pair = chunk.pairs[n];
        EXPECT_LT(pair.a - blocks_of(leaves.a).begin, blocks_of(leaves.a).size());
        EXPECT_LT(pair.b - blocks_of(leaves.b).begin, blocks_of(leaves.b).size());
        EXPECT_EQ(pair.excluded, tree.excluded(pair.a, pair.b));
        EXPECT_TRUE(pair.budget.exhausted(tree.travel.blocks[number_of(pair.a)],
                                          tree.travel.blocks[number_of(pair.b)], 0));
        EXPECT_TRUE(listed.emplace(pair.a, pair.b).second) << number_of(pair.a) << " " << number_of(pair.b);
      }
    }
  }
  for (BlockId a{0}; a < tree.shape.end_block(); ++a) {
    for (BlockId b = a; b < tree.shape.end_block(); ++b) {
      const auto names = [&] { return std::to_string(number_of(a)) + " " + std::to_string(number_of(b)); };
      EXPECT_EQ(listed.contains({a, b}), tree.leaves.shared->has_place(a, b)) << names();
      EXPECT_TRUE(listed.contains({a, b}) || (a != b && tree.leaves.shared->of(a, b) == 0)) << names();
    }
  }
  const testing::Hierarchy<KDop18> narrow(sheet.scene, testing::flat_sheet(), 8);
  EXPECT_TRUE(list_neighbours(narrow.bvh).empty()) << "a leaf is a block";
}

TEST(Neighbours, AreDueWhenTheirBudgetIsSpent) {
  std::mt19937_64 random(3);
  const auto any = [&](std::initializer_list<float> of) { return of.begin()[random() % of.size()]; };
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  const auto length = [&] {
    return any({0.0F, 0.25F, -0.25F, 0.5F, 1e30F, kInfinity, std::numeric_limits<float>::quiet_NaN()});
  };
  std::size_t due_in_all = 0;
  std::size_t in_all = 0;
  for (int trial = 0; trial < 3000; ++trial) {
    std::vector<NodeTravel> travel(5);
    const auto wander = [&] { return static_cast<std::uint32_t>(random() % 3) * travel::units(0.1F); };
    for (NodeTravel& t : travel) t = {{length(), length(), length()}, static_cast<std::uint32_t>(random())};
    if (trial % 4 != 0) {
      for (NodeTravel& t : travel) t.centre = {any({0, 0.25F}), any({0, 0.25F}), any({0, 0.25F})};
    }
    std::vector<NeighbourPair> pairs(random() % 11);
    for (NeighbourPair& pair : pairs) {
      pair.a = BlockId{static_cast<std::uint32_t>(random() % travel.size())};
      pair.b = BlockId{static_cast<std::uint32_t>(random() % travel.size())};
      pair.budget = TravelBudget::grant(travel[number_of(pair.a)], travel[number_of(pair.b)],
                                        any({-1, 0, 0.2F, 0.3F, kInfinity}));
    }
    for (NodeTravel& t : travel) {
      t.wandered += wander();
      t.centre[random() % 3] += any({0, 0, 0.1F, -0.2F});
    }
    const std::uint32_t slack = random() % 2 != 0 ? 10 : travel::kMost;
    std::vector<std::uint32_t> expected;
    for (std::uint32_t n = 0; n < pairs.size(); ++n) {
      if (pairs[n].budget.exhausted(travel[number_of(pairs[n].a)], travel[number_of(pairs[n].b)], slack))
        expected.push_back(n);
    }
    std::vector<std::uint32_t> due(pairs.size());
    due.resize(due_neighbours(pairs, travel, slack, due.data()));
    ASSERT_EQ(due, expected);
    due_in_all += due.size();
    in_all += pairs.size();
  }
  EXPECT_GT(due_in_all, in_all / 4);
  EXPECT_LT(due_in_all, in_all * 9 / 10);
}

// A block's travel bounds the motion of its contents.
template <class Bounds>
void expect_apart_while_it_lasts() {
  std::mt19937_64 random(17);
  Sheet<Bounds> sheet;
  const Bvh<Bounds>& tree = sheet.hierarchy.bvh;
  std::vector<NeighbourChunk> chunks = list_neighbours(tree);
  std::vector<double> positions = testing::flat_sheet();
  testing::shake(random, 0.02, positions);
  sheet.hierarchy.step(positions);
  const auto bounds = [&](BlockId block, std::uint32_t i) {
    Bounds sum = Bounds::empty();
    for (const std::uint32_t v :
         primitive_vertices(*sheet.scene, tree.order[tree.shape.begin_of_block(block) + i]))
      sum.merge(narrow<Bounds>(bounds_of(sheet.hierarchy.vertex_bounds()[v])));
    return sum;
  };
  const auto nearest = [&](const NeighbourPair& pair) {
    float least = std::numeric_limits<float>::max();
    for (std::uint64_t bits = ~pair.excluded; bits != 0; bits &= bits - 1) {
      const auto bit = static_cast<std::uint32_t>(std::countr_zero(bits));
      least = std::min(least, separation(bounds(pair.a, bit / 8), bounds(pair.b, bit % 8)));
    }
    return least;
  };
  std::size_t lasted = 0;
  std::size_t exhausted = 0;
  for (int step = 0; step < 30; ++step) {
    for (double& x : positions) x += 0.05;  // all alike: nobody's budget
    testing::shake(random, 0.002, positions);
    sheet.hierarchy.step(positions);
    for (NeighbourChunk& chunk : chunks) {
      std::vector<std::uint32_t> due(chunk.pairs.size());
      due.resize(due_neighbours(chunk.pairs, tree.travel.blocks, 2 * tree.travel.slack, due.data()));
      for (std::uint32_t n = 0; n < chunk.pairs.size(); ++n) {
        NeighbourPair& pair = chunk.pairs[n];
        const float gap = nearest(pair);
        if (std::ranges::binary_search(due, n)) {
          pair.budget = TravelBudget::grant(tree.travel.blocks[number_of(pair.a)],
                                            tree.travel.blocks[number_of(pair.b)], gap);
          ++exhausted;
        } else {
          ASSERT_GT(gap, 0) << "blocks " << number_of(pair.a) << " and " << number_of(pair.b) << ", step "
                            << step;
          ++lasted;
        }
      }
    }
  }
  // In a sheet along the axes, AABBs of triangles touch that share no vertex.
  const bool boxes = std::is_same_v<Bounds, Aabb>;
  EXPECT_GT(lasted, boxes ? 1000U : 3 * exhausted);
  EXPECT_GT(exhausted, 1000U);
}

TEST(Neighbours, StayApartWhileTheirBudgetLasts) {
  expect_apart_while_it_lasts<Aabb>();
  expect_apart_while_it_lasts<KDop18>();
}

TEST(Neighbours, AreLeftAloneWhereNothingMoves) {
  constexpr int kMany = 60;
  std::vector<double> positions;
  for (int i = 0; i <= kMany; ++i) {
    for (int j = 0; j <= kMany; ++j) positions.insert(positions.end(), {i * 0.1, j * 0.1, 0.0});
  }
  const auto scene = testing::make_scene((kMany + 1) * (kMany + 1), testing::grid(kMany));
  testing::Hierarchy<KDop18> hierarchy(scene, positions, 32);
  const std::vector<NeighbourChunk> listed = list_neighbours(hierarchy.bvh);
  const std::uint64_t chunks = listed.size();
  ASSERT_GE(chunks, 4U);
  for (const NeighbourChunk& chunk : listed) {
    for (const auto& leaves : chunk.leaves) {
      for (const LeafId leaf : {leaves.a, leaves.b}) {
        NodeSet moved;
        moved.add(hierarchy.bvh.shape.node_of(leaf));
        EXPECT_TRUE(chunk.nodes.meets(moved)) << number_of(leaf);
      }
    }
  }
  Front<KDop18> front;
  // Number of chunks that a step passes on when the first `moving` coordinates move.
  const auto handed_over = [&](std::size_t moving) {
    for (std::size_t k = 0; k < moving; ++k) positions[k] += 0.001;
    hierarchy.step(positions);
    testing::CountingSinks sinks;
    testing::advance(front, hierarchy, sinks, {.prune = false, .lazy = true});
    return sinks.neighbour_chunks.load();
  };
  EXPECT_EQ(handed_over(positions.size()), 0U) << "built: leaf pairs look at all";
  EXPECT_EQ(handed_over(0), chunks) << "listed";
  EXPECT_EQ(handed_over(positions.size()), chunks);
  handed_over(0);  // what moved comes to rest
  EXPECT_EQ(handed_over(0), 0U);
  const std::uint64_t few = handed_over(30);
  EXPECT_GT(few, 0U);
  EXPECT_LT(few, chunks);
}

// The front does not repeat the tests of neighbours that were made with the refit of their subtree.
TEST(Neighbours, AreTestedOnce) {
  Sheet<KDop18> sheet;
  std::vector<double> positions = testing::flat_sheet();
  Front<KDop18> front;
  testing::CountingSinks with_refit;
  bool test_subtrees = false;
  sheet.hierarchy.then = [&](std::uint32_t subtree) {
    if (test_subtrees) front.test_subtree(PartId{0}, subtree, with_refit);
  };
  // Number of chunks that the front passes on when the first `moving` coordinates move.
  const auto handed_over = [&](std::size_t moving) {
    for (std::size_t k = 0; k < moving; ++k) positions[k] += 0.01;
    sheet.hierarchy.step(positions);
    testing::CountingSinks sinks;
    testing::advance(front, sheet.hierarchy, sinks,
                     {.prune = false, .lazy = true, .subtrees_tested = test_subtrees});
    return sinks.neighbour_chunks.load();
  };
  const std::size_t all = positions.size();
  for (int step = 0; step < 2; ++step) {
    EXPECT_FALSE(front.neighbours().listed(PartId{0})) << "not yet";
    handed_over(all);
  }
  EXPECT_TRUE(front.neighbours().listed(PartId{0}));
  EXPECT_FALSE(front.neighbours().listed(PartId{1})) << "no such part";
  const std::uint64_t chunks = handed_over(all);
  EXPECT_EQ(chunks, front.neighbours().of(PartId{0}).size());
  test_subtrees = true;
  const std::uint32_t subtrees = sheet.hierarchy.bvh.shape.subtree_count();
  EXPECT_EQ(handed_over(all), chunks - subtrees) << "those of two subtrees are left";
  EXPECT_EQ(with_refit.neighbour_chunks, subtrees);
  handed_over(0);  // what moved comes to rest
  handed_over(0);
  with_refit.neighbour_chunks = 0;
  const std::uint64_t across = handed_over(30);
  EXPECT_GT(with_refit.neighbour_chunks, 0U);
  EXPECT_LT(with_refit.neighbour_chunks, subtrees);
  test_subtrees = false;
  handed_over(0);
  handed_over(0);
  EXPECT_EQ(handed_over(30), across + with_refit.neighbour_chunks.load()) << "each once";
}

}  // namespace
}  // namespace warmfront

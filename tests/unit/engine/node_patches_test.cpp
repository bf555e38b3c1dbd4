// SPDX-License-Identifier: Apache-2.0
// Nodes of a hierarchy that lie in one patch, and traversals that end where two of them do.
#include "engine/bvh/node_patches.h"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <random>
#include <set>
#include <vector>

#include "engine/collider.h"
#include "tests/support/hierarchy.h"
#include "tests/support/scenes.h"
#include "tests/support/workers.h"

namespace warmfront {
namespace {

constexpr int kSide = 24;
constexpr std::uint32_t kVertices = (kSide + 1) * (kSide + 1);

std::vector<double> crumpled(double phase) {
  std::vector<double> positions;
  for (int i = 0; i <= kSide; ++i) {
    for (int j = 0; j <= kSide; ++j)
      positions.insert(positions.end(), {2 * std::sin(1.7 * i + phase), 2 * std::sin(1.3 * j), 0.1 * i});
  }
  return positions;
}

TEST(NodePatches, AreThePatchOfAllVerticesBelow) {
  const auto scene = testing::make_scene(kVertices, testing::grid(kSide));
  std::mt19937 random(3);
  for (const std::uint32_t leaf_size : {1U, 8U, 64U}) {
    const testing::Hierarchy<KDop18> hierarchy(scene, crumpled(0), leaf_size);
    const Bvh<KDop18>& tree = hierarchy.bvh;
    EXPECT_TRUE(node_patches(*scene, tree.shape, tree.order, {}).empty());
    EXPECT_TRUE(
        node_patches(*scene, tree.shape, tree.order, std::vector<std::uint32_t>(kVertices, 0)).empty());
    // All in one, halves, a strip in none, and single vertices that are elsewhere.
    for (int kind = 0; kind < 4; ++kind) {
      std::vector<std::uint32_t> patches(kVertices, 7);
      for (std::uint32_t v = 0; v < kVertices && kind > 0; ++v) {
        if (v > kVertices / 2) patches[v] = 2;
        if (kind == 2 && v < kVertices / 5) patches[v] = 0;
        if (kind == 3 && random() % 40 == 0) patches[v] = 1;
      }
      const std::vector<std::uint32_t> found = node_patches(*scene, tree.shape, tree.order, patches);
      ASSERT_EQ(found.size(), tree.shape.node_count());
      for (NodeId node = kRoot; node < tree.shape.end_node(); ++node) {
        std::set<std::uint32_t> below;
        for (std::uint32_t i = tree.shape.begin(node); i < tree.shape.end(node); ++i) {
          for (const std::uint32_t v : primitive_vertices(*scene, tree.order[i])) below.insert(patches[v]);
        }
        EXPECT_EQ(found[number_of(node)], below.size() == 1 ? *below.begin() : 0U)
            << number_of(node) << " of kind " << kind;
      }
    }
  }
}

TEST(NodePatches, EndTheTraversal) {
  const auto counts = [](std::uint32_t patches) {
    SceneDescription description{kVertices, testing::grid(kSide), {}};
    for (std::uint32_t v = 0; v < kVertices; ++v)
      description.filters.patches.push_back(1 + v * patches / kVertices);
    const auto scene = std::make_shared<const Scene>(Scene::create(std::move(description)).value());
    const std::vector<double> start = crumpled(0);
    Collider collider =
        Collider::create(scene, std::span<const double>(start), {.find_bodies = false}, testing::workers())
            .value();
    StepCounts sum;
    for (int step = 1; step < 4; ++step) {  // the last ones with neighbours listed
      const std::vector<double> end = crumpled(0.1 * step);
      add(sum, collider.step(std::span<const double>(end)).value().statistics.counts);
    }
    return sum;
  };
  const StepCounts one = counts(1), many = counts(kVertices);
  EXPECT_LE(one.bv_tests, 3U);
  EXPECT_EQ(one.triangle_pairs, 0U);
  EXPECT_EQ(one.triangle_pairs_filtered, 0U) << "none was reached";
  EXPECT_GT(many.bv_tests, 20 * one.bv_tests);
  EXPECT_GT(many.triangle_pairs, 1000U);
}

}  // namespace
}  // namespace warmfront

// SPDX-License-Identifier: Apache-2.0
// The lookup equals the result computed from the vertices.
#include "engine/bvh/shared_vertices.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "engine/bvh/bvh.h"
#include "tests/support/hierarchy.h"
#include "tests/support/scenes.h"

namespace warmfront {
namespace {

using Blocks = std::vector<std::vector<Primitive>>;

SharedVertices shared_of(const Scene& scene, const Blocks& blocks) {
  std::vector<std::span<const Primitive>> spans(blocks.begin(), blocks.end());
  return {scene, spans};
}

// Blocks of eight (some of seven) of a random order of the faces.
Blocks random_blocks(std::mt19937_64& random, std::uint32_t faces) {
  std::vector<Primitive> order;
  for (std::uint32_t f = 0; f < faces; ++f) order.push_back(primitive_of_face(f));
  // Neighbours stay near each other, more or less.
  const std::size_t reach = std::size_t{1} << (random() % 12);
  for (std::size_t i = 0; i + 1 < order.size(); ++i)
    std::swap(order[i], order[i + random() % std::min(reach, order.size() - i)]);
  Blocks blocks;
  for (std::size_t at = 0; at < order.size();) {
    const std::size_t count = std::min<std::size_t>(8 - (random() % 5 == 0 ? 1 : 0), order.size() - at);
    blocks.emplace_back(order.begin() + static_cast<std::ptrdiff_t>(at),
                        order.begin() + static_cast<std::ptrdiff_t>(at + count));
    at += count;
  }
  return blocks;
}

// The excluded pairs, if any vertex is shared.
std::uint64_t expected(const Scene& scene, const Blocks& blocks, std::size_t a, std::size_t b) {
  const auto count_a = static_cast<std::uint32_t>(blocks[a].size());
  const auto count_b = static_cast<std::uint32_t>(blocks[b].size());
  std::uint64_t pairs = 0;
  for (std::size_t i = 0; i < blocks[a].size(); ++i) {
    for (std::size_t j = 0; j < blocks[b].size(); ++j) {
      const Face f = primitive_vertices(scene, blocks[a][i]);
      const Face g = primitive_vertices(scene, blocks[b][j]);
      const bool share = std::ranges::any_of(f, [&](auto v) { return std::ranges::find(g, v) != g.end(); });
      if (share) pairs |= std::uint64_t{1} << (8 * i + j);
    }
  }
  return pairs != 0 ? pairs | no_pairs(count_a, count_b, a == b) : 0;
}

void expect_all(const Scene& scene, const Blocks& blocks) {
  const SharedVertices shared = shared_of(scene, blocks);
  for (std::uint32_t a = 0; a < blocks.size(); ++a) {
    for (std::uint32_t b = 0; b < blocks.size(); ++b) {
      if (shared.crowded(BlockId{a}) && shared.crowded(BlockId{b})) continue;
      ASSERT_EQ(shared.of(BlockId{a}, BlockId{b}), expected(scene, blocks, a, b)) << a << " " << b;
    }
  }
}

// Orders near to the faces' own, and orders that scatter a block's triangles: then it shares vertices with
// more blocks than fit in its row.
TEST(SharedVertices, AreThoseOfTheFaces) {
  std::mt19937_64 random(3);
  for (int trial = 0; trial < 12; ++trial) {
    const auto scene = testing::make_scene(17 * 17, testing::grid(16));
    expect_all(*scene, random_blocks(random, scene->face_count()));
  }
}

TEST(SharedVertices, OfAVertexWithManyFacesAreLeftOut) {
  // Two fans, of which one has too many faces, and a point.
  testing::Faces faces;
  const auto fan = [&](int hub, int first, int count) {
    for (int i = 0; i < count; ++i) faces.push_back({hub, first + i, first + i + 1});
  };
  constexpr int kFew = SharedVertices::kMostAround;
  fan(0, 1, kFew);
  fan(kFew + 2, kFew + 3, kFew + 1);
  const auto scene = testing::make_scene(2 * kFew + 6, faces);
  Blocks blocks;
  for (std::uint32_t f = 0; f < faces.size(); ++f) {
    if (f % 8 == 0) blocks.emplace_back();
    blocks.back().push_back(primitive_of_face(f));
  }
  blocks.push_back({primitive_of_vertex(2 * kFew + 5)});
  expect_all(*scene, blocks);
  const SharedVertices shared = shared_of(*scene, blocks);
  EXPECT_FALSE(shared.crowded(BlockId{0}));
  EXPECT_TRUE(shared.crowded(BlockId{kFew / 8}));
  const auto end = static_cast<std::uint32_t>(blocks.size());
  EXPECT_TRUE(shared.crowded(BlockId{end - 2}));
  EXPECT_FALSE(shared.crowded(BlockId{end - 1}));
}

TEST(SharedVertices, OfAHierarchyAreThoseOfItsBlocks) {
  std::mt19937_64 random(4);
  for (const std::uint32_t leaf_size : {2U, 4U, 8U, 16U, 64U}) {
    auto [scene, positions] = testing::random_scene(random);
    const testing::Hierarchy<KDop18> hierarchy(scene, positions, leaf_size);
    const Bvh<KDop18>& bvh = hierarchy.bvh;
    Blocks blocks;
    for (BlockId b{0}; b < bvh.shape.end_block(); ++b) {
      const auto begin = bvh.order.begin() + bvh.shape.begin_of_block(b);
      blocks.emplace_back(begin, begin + bvh.shape.size_of_block(b));
    }
    for (std::uint32_t a = 0; a < blocks.size(); ++a) {
      for (std::uint32_t b = 0; b < blocks.size(); ++b) {
        const BlockId of_a{a}, of_b{b};
        ASSERT_EQ(bvh.excluded(of_a, of_b), expected(*scene, blocks, a, b))
            << leaf_size << ": " << a << " " << b;
        if (!bvh.leaves.shared->has_place(of_a, of_b)) {
          ASSERT_EQ(bvh.excluded_if_not_listed(of_a, of_b), bvh.excluded(of_a, of_b))
              << leaf_size << ": " << a << " " << b;
        }
      }
    }
  }
}

}  // namespace
}  // namespace warmfront

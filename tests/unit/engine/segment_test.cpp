// SPDX-License-Identifier: Apache-2.0
// A segment of the front that is divided again holds the same pairs in the same order, and what is kept of
// each.
#include "engine/front/segment.h"

#include <gtest/gtest.h>

#include <atomic>
#include <cstdint>
#include <random>
#include <tuple>
#include <utility>
#include <vector>

#include "tests/support/workers.h"

namespace warmfront {
namespace {

// Pairs by number; of some, so many contacts of that number are kept.
FrontSegment drawn(std::mt19937& random, const std::vector<std::size_t>& sizes) {
  FrontSegment segment;
  std::uint32_t number = 0;
  for (const std::size_t size : sizes) {
    FrontChunk& chunk = segment.chunks.emplace_back();
    for (std::uint32_t i = 0; i < size; ++i, ++number) {
      chunk.pairs.push_back({.nodes = {NodeId{number}, NodeId{number + 1}}, .budget = {}});
      if (random() % 3 != 0) continue;
      const std::uint32_t contacts = random() % 3;
      chunk.kept.pairs.push_back({i, number, contacts, {}});
      for (std::uint32_t c = 0; c < contacts; ++c)
        chunk.kept.contacts.push_back({ContactKind::kVertexFace, ContactStatus::kHit, number, c, 0.5});
    }
    chunk.find_nodes();
  }
  segment.size = number;
  return segment;
}

// All pairs, and what is kept by number of the pair.
using Held = std::tuple<std::vector<std::uint32_t>, std::vector<std::pair<std::uint32_t, std::uint32_t>>,
                        std::vector<Contact>>;
Held held(const FrontSegment& segment) {
  Held all;
  auto& [pairs, kept, contacts] = all;
  for (const FrontChunk& chunk : segment.chunks) {
    for (const KeptAnswers::OfPair& of : chunk.kept.pairs)
      kept.emplace_back(number_of(chunk.pairs[of.pair].nodes.a), of.contacts);
    for (const FrontPair& pair : chunk.pairs) pairs.push_back(number_of(pair.nodes.a));
    contacts.insert(contacts.end(), chunk.kept.contacts.begin(), chunk.kept.contacts.end());
  }
  return all;
}

TEST(Rebalance, SharesOutWhatChunksCost) {
  std::mt19937 random(2);
  FrontSegment segment = drawn(random, {400, 10, 10});
  segment.costs = {800, 30, 50};
  testing::workers()->run([&] { rebalance(segment, {}); });
  ASSERT_EQ(segment.costs.size(), segment.chunks.size());
  EXPECT_EQ(segment.costs.front(), 128U);            // 64 of 400 pairs
  EXPECT_EQ(segment.costs.back(), 32U + 30U + 50U);  // 16 of them, and the others
}

TEST(Rebalance, KeepsAllInOrder) {
  std::mt19937 random(1);
  for (int scene = 0; scene < 300; ++scene) {
    std::vector<std::size_t> sizes(random() % 60);
    for (std::size_t& size : sizes) size = random() % (random() % 4 == 0 ? 500 : random() % 3 == 0 ? 1 : 40);
    FrontSegment segment = drawn(random, sizes);
    const Held before = held(segment);
    testing::workers()->run([&] { rebalance(segment, {}); });
    ASSERT_EQ(held(segment), before) << "scene " << scene;
    for (const FrontChunk& chunk : segment.chunks) {
      EXPECT_LE(chunk.pairs.size(), 2 * FrontChunk::kPairs);
      for (const FrontPair& pair : chunk.pairs) {
        NodeSet of_pair;
        of_pair.add(pair.nodes.a);
        EXPECT_TRUE(chunk.nodes_a.meets(of_pair)) << "nodes of a chunk are those of its pairs";
      }
    }
    const std::size_t chunks = segment.chunks.size();
    testing::workers()->run([&] { rebalance(segment, {}); });
    EXPECT_EQ(segment.chunks.size(), chunks) << "nothing is left to do";
  }
}

// Few chunks of about the size that is wanted are left as they are.
TEST(Rebalance, LeavesWhatIsBalanced) {
  std::mt19937 random(2);
  FrontSegment segment = drawn(random, {64, 100, 30, 128, 60, 1});
  const FrontPair* first = segment.chunks.front().pairs.data();
  testing::workers()->run([&] { rebalance(segment, {}); });
  EXPECT_EQ(segment.chunks.size(), 6U);
  EXPECT_EQ(segment.chunks.front().pairs.data(), first);
}

TEST(Rebalance, StopsWhenTold) {
  std::mt19937 random(3);
  const std::atomic<bool> stop{true};
  FrontSegment segment = drawn(random, {1000, 1000});
  testing::workers()->run([&] { EXPECT_THROW(rebalance(segment, StopSignal(&stop)), Stopped); });
}

}  // namespace
}  // namespace warmfront

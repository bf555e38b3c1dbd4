// SPDX-License-Identifier: Apache-2.0
// As many newcomers take a gap as can, all find a place where there is one, and no block holds too many.
#include "engine/bvh/fill_blocks.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <random>
#include <vector>

namespace warmfront {
namespace {

bool is_around(const Newcomer& newcomer, std::uint32_t block) {
  return std::ranges::any_of(newcomer, [&](const BlocksAround* around) { return around->holds(block); });
}

// The most of these newcomers that gaps have room for, by trying everything.
std::size_t most_in_gaps(std::span<const Newcomer> newcomers, std::vector<BlockRoom>& rooms) {
  if (newcomers.empty()) return 0;
  std::size_t most = most_in_gaps(newcomers.subspan(1), rooms);
  for (std::uint32_t b = 0; b < rooms.size(); ++b) {
    if (rooms[b].gaps == 0 || !is_around(newcomers.front(), b)) continue;
    --rooms[b].gaps;
    most = std::max(most, 1 + most_in_gaps(newcomers.subspan(1), rooms));
    ++rooms[b].gaps;
  }
  return most;
}

std::size_t in_gaps(std::span<const Newcomer> newcomers, std::span<const std::uint32_t> block_of,
                    std::span<const BlockRoom> rooms) {
  std::vector<std::uint32_t> taken(rooms.size(), 0);
  for (std::size_t i = 0; i < newcomers.size(); ++i)
    taken[block_of[i]] += is_around(newcomers[i], block_of[i]) ? 1 : 0;
  std::size_t all = 0;
  for (std::size_t b = 0; b < rooms.size(); ++b) all += std::min(taken[b], rooms[b].gaps);
  return all;
}

TEST(FillBlocks, AsManyAsCanTakeAGap) {
  std::mt19937 random(3);
  const auto below = [&](std::size_t n) { return static_cast<std::uint32_t>(random() % n); };
  int matched_by_chains = 0, refused = 0;
  for (int trial = 0; trial < 3000; ++trial) {
    const std::uint32_t blocks = 1 + below(7);
    std::vector<BlockRoom> rooms(blocks);
    std::size_t all_room = 0;
    for (BlockRoom& room : rooms) {
      room.gaps = below(3);
      room.all = room.gaps + below(2);
      all_room += room.all;
    }
    std::vector<BlocksAround> vertices(1 + below(6));
    for (BlocksAround& around : vertices) {
      for (std::uint32_t i = below(3); i > 0; --i) around.add(below(blocks));
    }
    std::vector<Newcomer> newcomers(below(8));
    for (Newcomer& newcomer : newcomers) {
      for (const BlocksAround*& around : newcomer) around = &vertices[below(vertices.size())];
    }
    const std::vector<std::uint32_t> block_of = fill_blocks(newcomers, rooms, {});
    if (newcomers.size() > all_room) {
      ASSERT_TRUE(block_of.empty());
      ++refused;
      continue;
    }
    ASSERT_EQ(block_of.size(), newcomers.size());
    for (std::uint32_t b = 0; b < blocks; ++b) ASSERT_LE(std::ranges::count(block_of, b), rooms[b].all);
    std::vector<BlockRoom> left = rooms;
    const std::size_t most = most_in_gaps(newcomers, left);
    ASSERT_EQ(in_gaps(newcomers, block_of, rooms), most) << trial;
    // Who comes first to the first gap, without a chain.
    std::size_t greedy = 0;
    for (const Newcomer& newcomer : newcomers) {
      for (std::uint32_t b = 0; b < blocks; ++b) {
        if (left[b].gaps == 0 || !is_around(newcomer, b)) continue;
        --left[b].gaps;
        ++greedy;
        break;
      }
    }
    matched_by_chains += greedy < most ? 1 : 0;
  }
  EXPECT_GT(matched_by_chains, 20);
  EXPECT_GT(refused, 100);
}

TEST(FillBlocks, NobodyIsFarFromWhereItBelongs) {
  std::vector<BlockRoom> rooms(100);
  rooms[0].all = rooms[80].all = 1;
  BlocksAround around;
  around.add(kReach);
  const Newcomer newcomer{&around, &around, &around};
  EXPECT_EQ(fill_blocks({&newcomer, 1}, rooms, {}), std::vector<std::uint32_t>{0});
  rooms[0].all = 0;
  EXPECT_TRUE(fill_blocks({&newcomer, 1}, rooms, {}).empty());
}

TEST(FillBlocks, StopsWhenTold) {
  const std::vector<BlockRoom> rooms(2, BlockRoom{0, 1000});
  const BlocksAround nothing;
  const std::vector<Newcomer> newcomers(1000, Newcomer{&nothing, &nothing, &nothing});
  EXPECT_EQ(fill_blocks(newcomers, rooms, {}).size(), newcomers.size());
  const std::atomic<bool> stop{true};
  EXPECT_THROW(static_cast<void>(fill_blocks(newcomers, rooms, StopSignal(&stop))), Stopped);
}

}  // namespace
}  // namespace warmfront

// SPDX-License-Identifier: Apache-2.0
// When freed memory is given back, and that it is.
#include "server/process/free_memory.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <thread>
#include <utility>
#include <vector>

namespace warmfront::server {
namespace {

constexpr std::size_t kMiB = std::size_t{1} << 20;

MemoryUse use_of(std::size_t resident_mib, std::size_t allocated_mib, std::size_t free_mib) {
  return {resident_mib * kMiB, allocated_mib * kMiB, free_mib * kMiB};
}

TEST(FreeMemoryTest, IsDueWhenMuchIsFreeTwiceInARow) {
  FreeMemory memory;
  EXPECT_FALSE(memory.due(use_of(100, 10, 80)));
  EXPECT_FALSE(memory.due(use_of(20, 10, 5))) << "it was needed meanwhile";
  EXPECT_FALSE(memory.due(use_of(100, 10, 80)));
  EXPECT_TRUE(memory.due(use_of(100, 10, 80)));
}

TEST(FreeMemoryTest, IsNotDueAgainForWhatIsNotInRamOrNeverWasFree) {
  FreeMemory memory;
  memory.due(use_of(100, 10, 80));
  ASSERT_TRUE(memory.due(use_of(100, 10, 80)));
  memory.given_back(use_of(100, 10, 80), use_of(30, 10, 80));
  for (int i = 0; i < 3; ++i) EXPECT_FALSE(memory.due(use_of(30, 10, 80))) << "given back, and still free";
  for (int i = 0; i < 3; ++i) EXPECT_FALSE(memory.due(use_of(200, 10, 5))) << "of another allocator";
  memory.due(use_of(60, 10, 80));
  EXPECT_TRUE(memory.due(use_of(60, 10, 80))) << "in RAM again";
}

TEST(FreeMemoryTest, WhatIsFreedWhileMemoryIsGivenBackIsGivenBackNext) {
  FreeMemory memory;
  memory.due(use_of(300, 200, 80));
  ASSERT_TRUE(memory.due(use_of(300, 200, 80)));
  memory.given_back(use_of(300, 200, 80), use_of(230, 10, 270));
  memory.due(use_of(230, 10, 270));
  EXPECT_TRUE(memory.due(use_of(230, 10, 270)));
}

TEST(FreeMemoryTest, AShareOfFreeMemoryMayStay) {
  FreeMemory memory;
  for (int i = 0; i < 3; ++i) EXPECT_FALSE(memory.due(use_of(1240, 1000, 240)));
  memory.due(use_of(1260, 1000, 260));
  EXPECT_TRUE(memory.due(use_of(1260, 1000, 260)));
}

TEST(FreeMemoryTest, GoesBackThoughSomethingAboveItIsInUse) {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  GTEST_SKIP() << "the sanitizer has an allocator of its own";
#endif
  FreeMemory free_memory;
  // Settles what the tests before this one left.
  give_back_free_memory(free_memory);
  give_back_free_memory(free_memory);
  free_memory.given_back(*memory_use(), *memory_use());
  std::vector<char> above;
  std::thread([&above] {
    // Small enough to be the allocator's own and not a mapping each; written, so that they are in RAM.
    std::vector<std::vector<char>> pieces;
    for (int i = 0; i < 1800; ++i) pieces.emplace_back(32 * 1024, 'x');
    above = std::move(pieces.back());
  }).join();
  const MemoryUse freed = *memory_use();
  ASSERT_GT(freed.free, 50 * kMiB) << "the test shows nothing where memory went back by itself";
  EXPECT_EQ(give_back_free_memory(free_memory), 0U) << "seen once";
  EXPECT_GT(give_back_free_memory(free_memory), 50 * kMiB);
  EXPECT_LT(memory_use()->resident, freed.resident - 50 * kMiB);
  EXPECT_EQ(give_back_free_memory(free_memory), 0U);
  EXPECT_EQ(give_back_free_memory(free_memory), 0U) << "it is gone already";
}

}  // namespace
}  // namespace warmfront::server

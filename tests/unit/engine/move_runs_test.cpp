// SPDX-License-Identifier: Apache-2.0
// Runs of a list are moved to their new places, upwards and downwards in any mixture.
#include "engine/parallel/move_runs.h"

#include <gtest/gtest.h>

#include <numeric>

#include "tests/support/draws.h"

namespace warmfront {
namespace {

TEST(MoveRuns, KeepsWhatTheyHold) {
  testing::Draws draws(5);
  for (int trial = 0; trial < 5000; ++trial) {
    std::vector<warmfront::Run> runs;
    std::size_t from = 0, to = 0;
    for (int i = draws.below(6); i > 0; --i) {
      from += static_cast<std::size_t>(draws.below(4));
      to += static_cast<std::size_t>(draws.below(4));
      const auto count = static_cast<std::size_t>(draws.below(5));
      runs.push_back({from, count, to});
      from += count;
      to += count;
    }
    std::vector<int> list(from + static_cast<std::size_t>(draws.below(5)));
    std::iota(list.begin(), list.end(), 0);
    const std::size_t size = to + static_cast<std::size_t>(draws.below(5));
    make_room_for_runs(list, size, {});
    move_runs(list, runs, size);
    ASSERT_EQ(list.size(), size);
    EXPECT_LE(list.capacity(), 2 * size + 16);
    for (const warmfront::Run& run : runs) {
      for (std::size_t i = 0; i < run.count; ++i) ASSERT_EQ(list[run.to + i], static_cast<int>(run.from + i));
    }
  }
}

}  // namespace
}  // namespace warmfront

// SPDX-License-Identifier: Apache-2.0
// What several run()s share when they enter the arena once.
#include "engine/workers.h"

#include <gtest/gtest.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <atomic>
#include <cfenv>
#include <cstddef>
#include <limits>
#include <random>
#include <span>
#include <stdexcept>
#include <vector>

#include "engine/collider.h"
#include "engine/motion/check_positions.h"
#include "tests/support/scenes.h"
#include "tests/support/shaken_sheet.h"
#include "tests/support/workers.h"

namespace warmfront {
namespace {

TEST(WorkersEnterOnce, RunsAreInTheArenaAndInTheDefaultEnvironment) {
  Workers workers(3);
  std::fesetround(FE_UPWARD);
  std::atomic<int> strange{0}, done{0};
  int slots_between = 0;
  workers.enter_once([&] {
    slots_between = tbb::this_task_arena::max_concurrency();
    for (int run = 0; run < 2; ++run)
      workers.run([&] {
        tbb::parallel_for(0, 1000, [&](int) {
          strange += std::fegetround() != FE_TONEAREST || tbb::this_task_arena::max_concurrency() != 3;
          ++done;
        });
      });
  });
  EXPECT_EQ(std::fegetround(), FE_UPWARD);
  std::fesetround(FE_TONEAREST);
  EXPECT_EQ(slots_between, 3);
  EXPECT_EQ(strange.load(), 0);
  EXPECT_EQ(done.load(), 2000);
}

TEST(WorkersEnterOnce, ASmallRunBetweenLeavesTheArena) {
  Workers workers(2);
  int slots_alone = 0, slots_after = 0;
  workers.enter_once([&] {
    {
      const Workers::OneThread one_thread;
      workers.run([&] { slots_alone = tbb::this_task_arena::max_concurrency(); });
    }
    workers.run([&] { slots_after = tbb::this_task_arena::max_concurrency(); });
  });
  EXPECT_EQ(slots_alone, 1);
  EXPECT_EQ(slots_after, 2);
}

TEST(WorkersEnterOnce, ExceptionsPassThroughAndTheNextEntersAnew) {
  Workers workers(2);
  EXPECT_THROW(workers.enter_once([&] { workers.run([] { throw std::runtime_error("within"); }); }),
               std::runtime_error);
  EXPECT_THROW(workers.enter_once([] { throw std::runtime_error("between"); }), std::runtime_error);
  int slots = 0;
  workers.enter_once([&] { workers.enter_once([&] { slots = tbb::this_task_arena::max_concurrency(); }); });
  EXPECT_EQ(slots, 2);
  workers.run([&] { slots = 1; });
  EXPECT_EQ(slots, 1);
}

// A frame of so many numbers is checked by several threads, in the question's own entry.
TEST(WorkersEnterOnce, ALargeFrameThatFailsLeavesNoTrace) {
  constexpr int kCells = 110;
  constexpr std::size_t kVertices = (kCells + 1) * (kCells + 1);
  std::vector<double> flat;
  for (int i = 0; i <= kCells; ++i) {
    for (int j = 0; j <= kCells; ++j) flat.insert(flat.end(), {i * 0.1, j * 0.1, 0.0});
  }
  ASSERT_TRUE(check_forks(std::span<const double>(flat)));
  const auto scene = testing::make_scene(kVertices, testing::grid(kCells));
  const auto collider = [&] {
    return Collider::create(scene, std::span<const double>(flat), {}, testing::workers()).value();
  };
  std::mt19937_64 random(3);
  std::vector<double> first = flat, bad, second;
  testing::shake(random, 0.06, first);
  second = bad = first;
  testing::shake(random, 0.02, second);
  bad[3 * 12000 + 1] = std::numeric_limits<double>::quiet_NaN();
  Collider tried = collider(), other = collider();
  const auto step = [](Collider& of, const std::vector<double>& to) {
    return of.step(std::span<const double>(to)).value();
  };
  EXPECT_GT(step(tried, first).contacts.size(), 0U);
  step(other, first);
  for (const bool trial : {false, true}) {
    const Frame frame{std::span<const double>(bad)};
    const auto refused = trial ? tried.trial(frame) : tried.step(frame);
    ASSERT_FALSE(refused.ok());
    EXPECT_EQ(refused.error().message, "positions[12000].y: is not a number; coordinates must be finite");
  }
  const std::atomic<bool> cancelled{true};
  EXPECT_EQ(tried.step(std::span<const double>(second), &cancelled).error().code, ErrorCode::kCancelled);
  EXPECT_EQ(tried.positions(), first);
  const StepResult asked = step(tried, second), expected = step(other, second);
  EXPECT_GT(expected.contacts.size(), 0U);
  EXPECT_TRUE(std::ranges::equal(asked.contacts, expected.contacts));
}

}  // namespace
}  // namespace warmfront

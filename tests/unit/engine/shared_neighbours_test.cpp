// SPDX-License-Identifier: Apache-2.0
// Among many threads the neighbours of one subtree are shared out: each is tested once, by whichever thread.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <random>
#include <span>
#include <string_view>
#include <vector>

#include "engine/collider.h"
#include "engine/parallel/fork_trace.h"
#include "tests/support/scenes.h"
#include "tests/support/shaken_sheet.h"

namespace warmfront {
namespace {

Collider make(const std::vector<double>& at, double min_separation, int threads) {
  const auto scene = testing::make_scene(testing::kSheetVertices, testing::grid(testing::kSheetCells));
  return Collider::create(
             scene, std::span<const double>(at),
             {.min_separation = min_separation, .bounds = BoundsKind::kKDop18, .find_bodies = false},
             std::make_shared<Workers>(threads))
      .value();
}

// How often a step shares them out.
std::ptrdiff_t shares(Collider& collider, const Frame& frame) {
  ForkTrace trace;
  {
    const ForkTrace::Recording recording(trace);
    EXPECT_TRUE(collider.step(frame).ok());
  }
  return std::ranges::count_if(trace.events(), [](const ForkTrace::Event& event) {
    return event.file != nullptr && std::string_view(event.file).ends_with("leaf_pair_tester.h");
  });
}

TEST(SharedNeighbours, AreTestedOnce) {
  for (const double min_separation : {0.0, 0.02}) {
    std::mt19937_64 random(53);
    std::vector<double> positions = testing::flat_sheet();
    testing::shake(random, 0.08, positions);
    Collider one = make(positions, min_separation, 1);
    Collider many = make(positions, min_separation, 8);
    Collider traced = make(positions, min_separation, 1);
    std::ptrdiff_t shared = 0;
    std::uint64_t found = 0;
    for (int step = 0; step < 12; ++step) {
      if (step != 8) testing::shake(random, step % 3 == 0 ? 0.05 : 0.004, positions);
      const Frame frame{std::span<const double>(positions)};
      const StepResult a = one.step(frame).value();
      const StepResult b = many.step(frame).value();
      ASSERT_TRUE(std::ranges::equal(a.contacts, b.contacts)) << "step " << step;
      ASSERT_EQ(a.statistics.counts.triangle_pairs, b.statistics.counts.triangle_pairs) << "step " << step;
      ASSERT_EQ(a.statistics.counts.primitive_tests, b.statistics.counts.primitive_tests) << "step " << step;
      ASSERT_EQ(a.statistics.counts.bv_tests, b.statistics.counts.bv_tests) << "step " << step;
      ASSERT_EQ(a.statistics.counts.front_pairs, b.statistics.counts.front_pairs) << "step " << step;
      ASSERT_EQ(a.statistics.counts.front_bytes, b.statistics.counts.front_bytes) << "step " << step;
      const Status status = many.self_check();
      ASSERT_TRUE(status.ok()) << status.error().message;
      shared += shares(traced, frame);
      found += a.vf + a.ee;
    }
    EXPECT_GT(shared, 12);
    EXPECT_GT(found, 1000U);
  }
}

}  // namespace
}  // namespace warmfront

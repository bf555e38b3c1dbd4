// SPDX-License-Identifier: Apache-2.0
// Optional work must not fail a session: a caller whose deadline interrupts the measurement of a rigid part's
// clearance can continue. Deadlines are numbers of looks at the stop flag, so that the machine's speed does
// not matter.
#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <numbers>
#include <vector>

#include "engine/collider.h"
#include "tests/support/counted_looks.h"
#include "tests/support/scenes.h"

namespace warmfront {
namespace {

using testing::CountedLooks;
using Doubles = std::span<const double>;

constexpr int kCells = 24;

/// A wavy sheet that turns and falls as one piece, step by step.
std::vector<double> sheet_at(int step) {
  const double angle = 0.01 * step;
  std::vector<double> x;
  for (int i = 0; i <= kCells; ++i) {
    for (int j = 0; j <= kCells; ++j) {
      const double height = 0.5 * std::sin(0.5 * i) + 0.25 * std::cos(0.75 * j);
      x.push_back(std::cos(angle) * i - std::sin(angle) * j);
      x.push_back(std::sin(angle) * i + std::cos(angle) * j);
      x.push_back(height - 0.125 * step);
    }
  }
  return x;
}

Collider sheet() {
  auto scene = testing::make_scene((kCells + 1) * (kCells + 1), testing::grid(kCells));
  // One thread: the same looks in every run.
  return Collider::create(scene, Doubles(sheet_at(0)), {.bounds = BoundsKind::kKDop18},
                          std::make_shared<Workers>(1))
      .value();
}

bool stepped(Collider& collider, int step, long looks) {
  const CountedLooks deadline(looks);
  const std::vector<double> to = sheet_at(step);
  const auto result = collider.step(Doubles(to), CountedLooks::flag());
  if (!result) {
    EXPECT_EQ(result.error().code, ErrorCode::kCancelled);
  }
  return result.ok();
}

// How many looks a first step takes, which is the longest that a session must be able to afford.
long looks_of_a_cold_step() {
  for (long looks = 0;; ++looks) {
    Collider collider = sheet();
    if (stepped(collider, 1, looks)) return looks;
  }
}

TEST(InterruptedMeasurement, AnInterruptedMeasurementIsNotBegunAgainInTheNextStep) {
  constexpr int kMeasured = 16;  // RigidParts::kSteps
  constexpr long kAny = -1;
  Collider collider = sheet();
  for (int step = 1; step < kMeasured; ++step) ASSERT_TRUE(stepped(collider, step, kAny));
  const long cold = looks_of_a_cold_step();
  ASSERT_GT(cold, 20);
  ASSERT_FALSE(stepped(collider, kMeasured, cold / 2)) << "a warm step of the sheet takes no looks";
  for (int step = kMeasured; step < kMeasured + 200; ++step)
    ASSERT_TRUE(stepped(collider, step, cold + cold / 4)) << "step " << step;
}

}  // namespace
}  // namespace warmfront

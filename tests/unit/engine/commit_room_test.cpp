// SPDX-License-Identifier: Apache-2.0
// What room max_step() leaves for a commit's roundings, case by case; that nothing passes: part_way_test.cpp.
#include "engine/motion/commit_room.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <memory>
#include <span>
#include <vector>

#include "engine/collider.h"
#include "engine/part_way.h"
#include "engine/pose.h"
#include "tests/support/workers.h"

namespace warmfront {
namespace {

Collider collider_of(const SceneDescription& scene, std::span<const double> start, Tier tier) {
  return Collider::create(std::make_shared<const Scene>(Scene::create(scene).value()), start, {.tier = tier},
                          testing::workers())
      .value();
}

// Nearer than a commit rounds is near at the start; who leaves that out is told of what it meets.
TEST(CommitRoom, WhatStartsWithinTheRoomIsCountedAndStillTested) {
  const std::vector<double> start{0, 0, 0, 1, 0, 0, 0, 1, 0, 0.25, 0.25, 1e-8};
  std::vector<double> through = start, away = start;
  for (std::vector<double>* end : {&through, &away}) {
    for (std::size_t v = 0; v < 3; ++v) (*end)[3 * v + 2] += 1;
  }
  away[11] += 2;
  SceneDescription scene{4, {{0, 1, 2}}, {{"", 0, 3}, {"", 3, 1}}};
  for (const Tier tier : {Tier::kCertified, Tier::kExact}) {
    Collider collider = collider_of(scene, start, tier);
    const auto ask = [&](const std::vector<double>& end, bool leave_out, Rounding rounding) {
      return collider
          .max_step(std::span<const double>(end), leave_out, {.tolerance = 1e-12}, nullptr, rounding)
          .value();
    };
    for (const auto& end : {through, away}) {
      const MaxStep near = ask(end, false, Rounding::kFloat32);
      EXPECT_EQ(near.fraction, 0);
      EXPECT_EQ(near.overlaps_at_start, 1U);
    }
    const MaxStep passes = ask(through, true, Rounding::kFloat32);
    EXPECT_EQ(passes.overlaps_at_start, 1U);
    EXPECT_GT(passes.fraction, 0);
    EXPECT_LE(passes.fraction, 1e-8);
    EXPECT_EQ(ask(away, true, Rounding::kFloat32).fraction, 1);
    // Doubles have room.
    EXPECT_EQ(ask(away, false, Rounding::kFloat64).fraction, 1);
    EXPECT_GT(ask(through, false, Rounding::kFloat64).fraction, 0);
  }
}

// A vertex that rests is not rounded: a far one does not count, and one that flies off stops nothing else.
TEST(CommitRoom, TheRoomIsThatOfEachPair) {
  std::vector<double> start{0, 0, 0, 1, 0, 0, 0, 1, 0, 0.25, 0.25, 1e-4, 0, 0, 1e9};
  std::vector<double> end = start;
  end[11] += 0.5;
  end[14] += 1e9;
  SceneDescription scene{5, {{0, 1, 2}}, {{"", 0, 3}, {"", 3, 1}, {"", 4, 1}}};
  Collider collider = collider_of(scene, start, Tier::kCertified);
  const MaxStep far =
      collider.max_step(std::span<const double>(end), false, {}, nullptr, Rounding::kFloat32).value();
  EXPECT_EQ(far.fraction, 1);
  EXPECT_EQ(far.overlaps_at_start, 0U);
}

// All vertices of what goes from pose to pose are placed anew, also one on the axis, which both ends leave
// where it is.
TEST(CommitRoom, AVertexOnTheAxisOfATurnHasRoom) {
  const std::vector<double> start{3 - 3e-8, 4, -1, 3 - 3e-8, 6, -1, 3 - 3e-8, 5, 1, 3, 5, 0};
  SceneDescription scene{4, {{0, 1, 2}}, {{"", 0, 3, BodyKind::kStatic}, {"", 3, 1, BodyKind::kRigid}}};
  BodyPose turned{1, {}};
  turned.pose.matrix = {0, -1, 0, 8, 1, 0, 0, 2, 0, 0, 1, 0};
  ASSERT_EQ(turned.pose.place(start.data() + 9), (std::array<double, 3>{3, 5, 0}));
  Frame frame;
  frame.poses = {&turned, 1};
  for (const bool screw : {false, true}) {
    scene.bodies[1].screw = screw;
    Collider collider = collider_of(scene, start, Tier::kCertified);
    const MaxStep far = collider.max_step(frame, false, {}, nullptr, Rounding::kFloat32).value();
    EXPECT_EQ(far.fraction, 0) << screw;
    EXPECT_EQ(far.overlaps_at_start, 1U) << screw;
  }
}

// What it meets within the widest room is noted for questions about part of the way, points among it.
TEST(CommitRoom, AQuestionAfterItFindsWhatAFreshOneDoes) {
  const std::vector<double> start{1000, 0.01, 0, 1000, 0, 0, 1000, 0, 9, 1001, 0, 9, 1000, 1, 9};
  std::vector<double> end = start, half = start;
  for (std::size_t v = 0; v < 5; ++v) end[3 * v + 1] += v == 0 ? -0.02 : 0.001;
  for (std::size_t i = 0; i < end.size(); ++i) half[i] = part_way(start[i], end[i], 0.75, false);
  const SceneDescription scene{5, {{2, 3, 4}}, {{"", 0, 5}}};
  const auto collider = [&] {
    return Collider::create(std::make_shared<const Scene>(Scene::create(scene).value()),
                            std::span<const double>(start), {.find_rigid = false}, testing::workers())
        .value();
  };
  Collider asked = collider(), fresh = collider();
  ASSERT_EQ(
      asked.max_step(std::span<const double>(end), false, {}, nullptr, Rounding::kFloat32).value().fraction,
      1);
  const QuestionOptions near{.min_separation = 1e-4};
  const StepResult found = asked.trial(std::span<const double>(half), near).value();
  const StepResult expected = fresh.trial(std::span<const double>(half), near).value();
  EXPECT_TRUE(std::ranges::equal(found.contacts, expected.contacts));
  EXPECT_EQ(expected.contacts.size(), 1U);
  EXPECT_TRUE(found.statistics.part_of_trial);
}

}  // namespace
}  // namespace warmfront

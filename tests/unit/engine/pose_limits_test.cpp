// SPDX-License-Identifier: Apache-2.0
// Poses at the bounds of what passes: what a frame takes can be placed again, and nothing goes beyond
// double's range.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <memory>
#include <random>
#include <vector>

#include "engine/collider.h"
#include "engine/part_way.h"
#include "engine/pose.h"
#include "engine/screw.h"
#include "tests/support/poses.h"
#include "tests/support/workers.h"

namespace warmfront {
namespace {

using ::testing::HasSubstr;

Pose multiplied(const Pose& a, const Pose& b) {
  Pose product;
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 4; ++column) {
      double& sum = product.matrix[4 * row + column] = column == 3 ? a.matrix[4 * row + 3] : 0;
      for (int k = 0; k < 3; ++k) sum += a.matrix[4 * row + k] * b.matrix[4 * k + column];
    }
  }
  return product;
}

/// A rotation, each number of which is off by up to `noise`.
Pose nearly_rigid(std::mt19937& random, double noise) {
  std::uniform_real_distribution<double> angle(-3, 3), off(-noise, noise);
  Pose about_z;
  const double turned = angle(random);
  about_z.matrix = {
      std::cos(turned), -std::sin(turned), 0, 0, std::sin(turned), std::cos(turned), 0, 0, 0, 0, 1, 0};
  Pose pose = multiplied(testing::turned_about_x(angle(random)), about_z);
  for (std::size_t i = 0; i < 12; ++i) pose.matrix[i] += off(random);
  return pose;
}

// A session is made again where it was: at the pose of its last frame, or part of the way to it.
TEST(PoseLimits, WhatAFrameTakesMayBePlacedAgain) {
  Pose longest;
  for (std::size_t i = 0; i < 12; ++i)
    if (i % 4 != 3) longest.matrix[i] += 0.45e-5;
  EXPECT_TRUE(check_pose(longest, "pose").ok());
  EXPECT_TRUE(check_pose(longest, "pose", PoseCheck::kPartWay).ok());
  std::mt19937 random(3);
  std::uniform_real_distribution<double> fraction(0, 1);
  int pairs = 0;
  for (int k = 0; k < 20000; ++k) {
    const Pose a = nearly_rigid(random, 7e-6), b = nearly_rigid(random, 7e-6);
    if (!check_pose(a, "a") || !check_pose(b, "b")) continue;
    ++pairs;
    const double f = fraction(random);
    for (const Pose& left :
         {a, part_way(a, b, f, false), screw_way(a, b, f, false), screw_way(a, b, f, true)})
      ASSERT_TRUE(check_pose(left, "pose", PoseCheck::kPartWay).ok()) << k;
  }
  EXPECT_GT(pairs, 100);
  Pose stretched;
  stretched.matrix[0] = 1.0002;
  EXPECT_FALSE(check_pose(stretched, "pose", PoseCheck::kPartWay).ok());
}

TEST(PoseLimits, NothingIsPutBeyondTheLargestNumber) {
  constexpr double kFar = 1e308;
  SceneDescription scene{4, {{0, 1, 2}}, {{"", 0, 3, BodyKind::kRigid}, {"", 3, 1}, {"ground", 4, 0}}};
  scene.bodies[2].kind = BodyKind::kRigid;
  scene.bodies[2].half_space = HalfSpace{{0, 0, -kFar}, {0, 0, 1}};
  const std::vector<double> x{0, 0, 0, kFar, 0, 0, 0, kFar, 0, 5, 5, 5};
  Collider collider = Collider::create(std::make_shared<const Scene>(Scene::create(scene).value()),
                                       std::span<const double>(x), {}, testing::workers())
                          .value();
  std::vector<BodyPose> poses(1);
  Frame frame;
  const auto asked = [&](std::uint32_t body, std::size_t entry, double to) {
    poses[0] = {body, {}};
    poses[0].pose.matrix[entry] = to;
    frame.poses = poses;
    const auto trial = collider.trial(frame);
    return trial ? std::string() : trial.error().message;
  };
  EXPECT_THAT(asked(0, 3, 1.5e308),
              HasSubstr("poses[0]: body 0: pose: puts something beyond the largest number"));
  EXPECT_EQ(asked(0, 3, 0.7e308), "");
  EXPECT_THAT(asked(0, 3, 1.5e308), HasSubstr("beyond")) << "after a trial, too";
  EXPECT_EQ(asked(0, 3, -1.5e308), "");
  EXPECT_THAT(asked(2, 11, -kFar), HasSubstr("body 2 (\"ground\"): pose: puts something beyond"));
  EXPECT_EQ(asked(2, 11, kFar), "");
  poses[0] = {0, {}};
  poses[0].pose.matrix[3] = 1.5e308;
  EXPECT_FALSE(collider.place(poses).ok());
  for (const double at : collider.positions()) EXPECT_TRUE(std::isfinite(at));
}

}  // namespace
}  // namespace warmfront

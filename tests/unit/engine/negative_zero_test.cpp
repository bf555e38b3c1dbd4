// SPDX-License-Identifier: Apache-2.0
// What is not taken leaves no trace: not in the sign of a zero either, by which a motion that leads to where
// a body is would be a motion.
#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <span>
#include <vector>

#include "engine/collider.h"

namespace warmfront {
namespace {

// Two triangles that touch, of which the first is rigid and has a vertex at x = -0.
const std::vector<double> kAt{-0.0, -1, 0, 1, 0, 0, 0, 1, 0, -0.5, -0.2, 0, 0.8, -0.2, 0, 0.2, 0.3, 0.5};

Collider touching() {
  SceneDescription scene;
  scene.vertex_count = 6;
  scene.faces = {{0, 1, 2}, {3, 4, 5}};
  scene.bodies = {{"", 0, 3, BodyKind::kRigid}, {"", 3, 3}};
  return Collider::create(std::make_shared<const Scene>(Scene::create(scene).value()),
                          std::span<const double>(kAt), {}, std::make_shared<Workers>(1))
      .value();
}

std::vector<BodyPose> raised(double z) {
  BodyPose pose{0, {}};
  pose.pose.matrix[11] = z;
  return {pose};
}

void expect_untouched(Collider& collider) {
  EXPECT_TRUE(std::signbit(collider.positions()[0]));
  EXPECT_EQ(collider.max_step(Frame(std::span<const double>(kAt))).value().fraction, 1);
}

TEST(NegativeZero, OutlivesATrialOfWhichNothingIsTaken) {
  Collider collider = touching();
  expect_untouched(collider);
  const std::vector<BodyPose> poses = raised(0.1);
  Frame frame;
  frame.poses = poses;
  ASSERT_TRUE(collider.trial(frame).ok());
  ASSERT_TRUE(collider.commit(0).ok());
  expect_untouched(collider);
}

TEST(NegativeZero, IsWhereTheIdentityPutsIt) {
  EXPECT_TRUE(std::signbit(Pose().place(kAt.data())[0]));
  Collider collider = touching();
  const std::vector<BodyPose> poses = raised(0);
  ASSERT_TRUE(collider.place(poses).ok());
  expect_untouched(collider);
}

}  // namespace
}  // namespace warmfront

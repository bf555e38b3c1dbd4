// SPDX-License-Identifier: Apache-2.0
// A failed call changes nothing: specific failures by name. tests/faults injects failures everywhere.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <memory>
#include <numbers>
#include <vector>

#include "engine/collider.h"
#include "engine/state/core.h"
#include "tests/support/scenes.h"
#include "tests/support/workers.h"

namespace warmfront {
namespace {

using ::testing::HasSubstr;
using testing::workers;
using Doubles = std::span<const double>;

constexpr std::uint32_t kBall = 0;
constexpr std::uint32_t kGround = 1;

/// A rigid octahedron above a deformable one that does not touch it.
struct TwoBodies {
  TwoBodies() {
    for (const double height : {0.0, -4.0}) {
      const auto first = static_cast<std::int32_t>(x.size() / 3);
      for (auto face : testing::octahedron()) {
        for (auto& v : face) v += first;
        description.faces.push_back(face);
      }
      for (int axis = 0; axis < 3; ++axis) {
        for (const double sign : {-1.0, 1.0}) {
          for (int k = 0; k < 3; ++k) x.push_back((k == axis ? sign : 0) + (k == 1 ? height : 0));
        }
      }
    }
    description.bodies = {{"ball", 0, 6, BodyKind::kRigid}, {"ground", 6, 6, BodyKind::kDeformable}};
    description.vertex_count = 12;
  }

  Collider collider(const ColliderOptions& options = {}) const { return collider(x, options); }
  Collider collider(Doubles from, const ColliderOptions& options) const {
    auto scene = std::make_shared<const Scene>(Scene::create(description).value());
    return Collider::create(scene, from, options, workers()).value();
  }
  std::vector<double> ball_at(double height) const {
    std::vector<double> ball(x.begin(), x.begin() + 18);
    for (std::size_t i = 1; i < ball.size(); i += 3) ball[i] += height;
    return ball;
  }

  SceneDescription description;
  std::vector<double> x;
};

Pose raised(double by) {
  Pose pose;
  pose.matrix[7] = by;
  return pose;
}

Result<StepResult> pose_ball(Collider& collider, const Pose& pose, const std::atomic<bool>* stop = nullptr) {
  const BodyPose at{kBall, pose};
  Frame frame;
  frame.poses = {&at, 1};
  return collider.step(frame, stop);
}

Result<StepResult> place_body(Collider& collider, std::uint32_t body, const std::vector<double>& positions,
                              const std::atomic<bool>* stop = nullptr) {
  const BodyPositions at{body, Doubles(positions)};
  Frame frame;
  frame.bodies = {&at, 1};
  return collider.step(frame, stop);
}

// The body was at +10 by a pose, then given by positions that met max_contacts: the next pose took these for
// its reference shape.
TEST(Transaction, ARefusedFrameOfPositionsLeavesThePosedShape) {
  const TwoBodies bodies;
  Collider collider = bodies.collider({.max_contacts = 1});
  ASSERT_TRUE(pose_ball(collider, raised(10)).ok());
  const std::vector<double> before = collider.positions();
  ASSERT_EQ(place_body(collider, kBall, bodies.ball_at(-4)).error().code, ErrorCode::kResourceExhausted);
  EXPECT_EQ(collider.positions(), before);
  ASSERT_TRUE(pose_ball(collider, raised(11)).ok());
  EXPECT_EQ(collider.positions()[1], bodies.x[1] + 11);
}

TEST(Transaction, ACancelledFrameOfPositionsLeavesThePosedShape) {
  const TwoBodies bodies;
  Collider collider = bodies.collider();
  ASSERT_TRUE(pose_ball(collider, raised(10)).ok());
  const std::atomic<bool> stop{true};
  ASSERT_EQ(place_body(collider, kBall, bodies.ball_at(-4), &stop).error().code, ErrorCode::kCancelled);
  ASSERT_TRUE(pose_ball(collider, raised(11)).ok());
  EXPECT_EQ(collider.positions()[1], bodies.x[1] + 11);
}

// The other way round: a refused pose must not make the former positions the reference shape.
TEST(Transaction, ARefusedPoseLeavesABodyOfPositions) {
  const TwoBodies bodies;
  Collider collider = bodies.collider({.max_contacts = 1});
  ASSERT_TRUE(place_body(collider, kBall, bodies.ball_at(3)).ok());
  const std::vector<double> before = collider.positions();
  ASSERT_EQ(pose_ball(collider, raised(-8)).error().code, ErrorCode::kResourceExhausted);
  EXPECT_EQ(collider.positions(), before);
  ASSERT_TRUE(place_body(collider, kBall, bodies.ball_at(4)).ok());
  ASSERT_TRUE(pose_ball(collider, raised(1)).ok()) << "of where it is now";
  EXPECT_EQ(collider.positions()[1], bodies.x[1] + 5);
}

TEST(Transaction, BodiesArePutAtPosesBeforeTheFirstStepOnly) {
  const TwoBodies bodies;
  Collider collider = bodies.collider();
  const BodyPose pose{kBall, raised(10)};
  const BodyPose second{kGround, raised(1)};
  ASSERT_FALSE(collider.place(std::array{pose, second}).ok()) << "is not rigid";
  EXPECT_EQ(collider.positions(), bodies.x);
  ASSERT_TRUE(collider.place({&pose, 1}).ok());
  ASSERT_TRUE(pose_ball(collider, raised(11)).ok());
  const Status late = collider.place({&pose, 1});
  ASSERT_FALSE(late.ok());
  EXPECT_EQ(late.error().code, ErrorCode::kFailedPrecondition);
  EXPECT_THAT(late.error().message, HasSubstr("before the first step"));
  EXPECT_EQ(collider.positions()[1], bodies.x[1] + 11);
}

/// A core that steps its motion only.
struct Moving {
  explicit Moving(const TwoBodies& bodies)
      : scene(std::make_shared<const Scene>(Scene::create(bodies.description).value())),
        core(scene, *scene, Doubles(bodies.x), {}, workers()) {}

  double magnitude() const { return core.motion.vertices().magnitude(); }
  void step(const Frame& frame, bool commit = true) {
    ASSERT_TRUE(core.motion.check(*scene, frame).ok());
    core.workers->run([&] {
      SceneMotion::Step step(core.motion);
      step.begin(frame);
      if (commit) step.commit();
    });
  }

  std::shared_ptr<const Scene> scene;
  Core core;
};

// Bounds are as loose as the magnitude is large.
TEST(Transaction, TheMagnitudeFollowsWhatIsThere) {
  const TwoBodies bodies;
  Moving moving(bodies);
  const double before = moving.magnitude();
  std::vector<double> far = bodies.x;
  far.back() = 1e6;
  moving.step(Doubles(far), false);
  EXPECT_EQ(moving.magnitude(), before) << "the frame was refused";
  moving.step(Doubles(far));
  EXPECT_GT(moving.magnitude(), 1000 * before);
  moving.step(Doubles(bodies.x));
  EXPECT_GT(moving.magnitude(), 1000 * before) << "where the step begins counts";
  moving.step(Doubles(bodies.x));
  EXPECT_LE(moving.magnitude(), 2 * before);

  const std::uint32_t vertex[]{11};
  Frame one;
  one.vertices = vertex;
  one.vertex_positions = Doubles(far).last(3);
  moving.step(one);
  EXPECT_GT(moving.magnitude(), 1000 * before);
  one.vertex_positions = Doubles(bodies.x).last(3);
  for (int k = 0; k < 40; ++k) moving.step(one);
  EXPECT_LE(moving.magnitude(), 2 * before);

  const BodyPose away{kBall, raised(1e6)};
  const BodyPose back{kBall, raised(0)};
  Frame poses;
  poses.poses = {&away, 1};
  moving.step(poses);
  EXPECT_GT(moving.magnitude(), 1000 * before);
  poses.poses = {&back, 1};
  for (int k = 0; k < 2; ++k) moving.step(poses);
  EXPECT_LE(moving.magnitude(), 2 * before);
}

// Budgets were granted at the outlier's magnitude: later contacts equal those of a collider that starts
// here.
TEST(Transaction, ContactsAfterAnOutlierAreThoseOfAFreshCollider) {
  const TwoBodies bodies;
  Collider collider = bodies.collider();
  std::vector<double> at = bodies.x;
  for (int k = 0; k < 12; ++k) {
    std::vector<double> to = bodies.x;
    for (std::size_t i = 1; i < 18; i += 3) to[i] += 0.31 * k;
    if (k == 3) to.back() = 1e9;
    Collider fresh = bodies.collider(at, {});
    const StepResult warm = collider.step(Doubles(to)).value();
    const StepResult cold = fresh.step(Doubles(to)).value();
    EXPECT_TRUE(std::ranges::equal(warm.contacts, cold.contacts)) << k;
    at = to;
  }
}

}  // namespace
}  // namespace warmfront

// SPDX-License-Identifier: Apache-2.0
// Bodies that move along screws: what lines miss and invent of them, what a commit leaves, and what is
// refused.
#include "engine/screw.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "engine/collider.h"
#include "tests/support/workers.h"

namespace warmfront {
namespace {

using ::testing::HasSubstr;
using testing::workers;

constexpr double kPi = std::numbers::pi;

// About the z axis.
Pose turned(double angle) {
  Pose pose;
  pose.matrix[0] = pose.matrix[5] = std::cos(angle);
  pose.matrix[1] = -std::sin(angle);
  pose.matrix[4] = std::sin(angle);
  return pose;
}

// A triangle whose corner is at (2, 0, 0), and points that rest on the x-y plane at these places.
SceneDescription hand_and(std::size_t points, bool screw) {
  SceneDescription scene;
  scene.vertex_count = static_cast<std::uint32_t>(3 + points);
  scene.faces = {{0, 1, 2}};
  scene.bodies.push_back({"hand", 0, 3, BodyKind::kRigid});
  scene.bodies.back().screw = screw;
  scene.bodies.push_back({"points", 3, static_cast<std::uint32_t>(points), BodyKind::kStatic});
  return scene;
}

const std::vector<double> kHand{0, -0.1, 0, 0, 0.1, 0, 2, 0, 0};

Result<Collider> made(const SceneDescription& scene, std::vector<double> points,
                      const ColliderOptions& options) {
  std::vector<double> x = kHand;
  x.insert(x.end(), points.begin(), points.end());
  return Collider::create(std::make_shared<const Scene>(Scene::create(scene).value()),
                          std::span<const double>(x), options, workers());
}

StepResult step_of(Collider& collider, double angle) {
  const BodyPose pose{0, turned(angle)};
  Frame frame;
  frame.poses = {&pose, 1};
  Result<StepResult> result = collider.step(frame);
  EXPECT_TRUE(result.ok());
  return std::move(result).value();
}

// On the arc at 60 degrees, near the middle of the chord of 120, and beyond both.
const std::vector<double> kThree{2 * 0.5, 2 * 0.8660254037844386, 0, 0.25, 0.43, 0, 1.2, 2.2, 0};

// At angles on both sides of where the series take more terms, and at the largest one. (Sines of long doubles
// lose some 20 bits of them to differences of nearly equal numbers, at small angles.)
TEST(Twists, SharesAndTheirRatesAreThoseOfSinesAndCosines) {
  for (const double angle : {0.1, 0.24, 0.26, 0.7, 0.71, 1.65, 1.66, 2.5, kPi}) {
    const Twist twist = twist_between(Pose{}, turned(angle));
    const long double a = angle;
    const auto bend = [a](long double s) { return (1 - std::cos(a * s)) / (a * a); };
    const auto turn = [a](long double s) { return (a * s - std::sin(a * s)) / (a * a * a); };
    for (const double s : {0.0, 0x1p-6, 0.3, 0.5, 0.9, 1.0}) {
      const auto [shares, rates] = arc_rates(twist, s);
      constexpr double kOff = 0x1p-40;
      EXPECT_NEAR(shares.of_bend, static_cast<double>(bend(s) - s * bend(1)), kOff) << angle << " at " << s;
      EXPECT_NEAR(shares.of_turn, static_cast<double>(turn(s) - s * turn(1)), kOff) << angle << " at " << s;
      EXPECT_NEAR(rates.of_bend, static_cast<double>(std::sin(a * s) / a - bend(1)), kOff);
      EXPECT_NEAR(rates.of_turn, static_cast<double>(bend(s) - turn(1)), kOff) << angle << " at " << s;
    }
  }
}

TEST(ScrewBodies, MeetOnTheirArcsWhatLinesMissAndMissWhatLinesInvent) {
  const ColliderOptions options{.min_separation = 0.01};
  Collider screw = made(hand_and(3, true), kThree, options).value();
  Collider lines = made(hand_and(3, false), kThree, options).value();
  const StepResult on_screw = step_of(screw, 2 * kPi / 3);
  const StepResult on_lines = step_of(lines, 2 * kPi / 3);
  // The hand goes over both points; its lines pass before the first.
  ASSERT_EQ(on_screw.contacts.size(), 2U);
  EXPECT_EQ(on_screw.contacts[0].a, 3U);
  EXPECT_NEAR(on_screw.contacts[0].toi, 0.5, 0.01);
  EXPECT_EQ(on_screw.contacts[1].a, 4U);
  for (const Contact& contact : on_lines.contacts) EXPECT_NE(contact.a, 3U);
}

TEST(ScrewBodies, AreWhereTheScrewPutsThemAfterACommit) {
  for (const Rounding rounding : {Rounding::kFloat64, Rounding::kFloat32}) {
    Collider collider = made(hand_and(3, true), kThree, {}).value();
    const BodyPose pose{0, turned(2 * kPi / 3)};
    Frame frame;
    frame.poses = {&pose, 1};
    ASSERT_TRUE(collider.trial(frame).ok());
    ASSERT_TRUE(collider.commit(0.25, rounding).ok());
    const Pose quarter = screw_way({}, pose.pose, 0.25, rounding == Rounding::kFloat32);
    const auto corner = quarter.place(kHand.data() + 6);
    const std::vector<double> x = collider.positions();
    EXPECT_EQ(std::vector<double>(x.begin() + 6, x.begin() + 9),
              std::vector<double>(corner.begin(), corner.end()));
    EXPECT_NEAR(std::hypot(x[6], x[7]), 2, 1e-6);  // as far from the axis as it was
    EXPECT_NEAR(std::atan2(x[7], x[6]), kPi / 6, 1e-6);
    // From there on it goes as if it had been there from the start.
    Collider fresh = made(hand_and(3, true), kThree, {}).value();
    ASSERT_TRUE(fresh.place(std::vector<BodyPose>{{0, quarter}}).ok());
    const StepResult one = step_of(collider, kPi);
    const StepResult other = step_of(fresh, kPi);
    EXPECT_TRUE(std::ranges::equal(one.contacts, other.contacts));
    EXPECT_FALSE(one.contacts.empty());
  }
}

// Where nothing turns there is no arc: the same bits as along lines, in every field.
TEST(ScrewBodies, ThatDoNotTurnMoveAlongLines) {
  const ColliderOptions options{.min_separation = 0.01,
                                .fields = {.weights = true, .normal = true, .points = true}};
  std::vector<std::vector<Contact>> found;
  for (const bool screw : {true, false}) {
    Collider collider = made(hand_and(3, screw), kThree, options).value();
    Pose shifted;
    shifted.matrix[7] = 1;
    const BodyPose pose{0, shifted};
    Frame frame;
    frame.poses = {&pose, 1};
    const StepResult result = collider.step(frame).value();
    found.emplace_back(result.contacts.begin(), result.contacts.end());
  }
  EXPECT_EQ(found[0], found[1]);
  EXPECT_FALSE(found[0].empty());
}

TEST(ScrewBodies, PositionsMoveThemAlongLines) {
  std::vector<std::vector<Contact>> found;
  for (const bool screw : {true, false}) {
    Collider collider = made(hand_and(3, screw), kThree, {.min_separation = 0.01}).value();
    std::vector<double> to;
    for (std::size_t v = 0; v < 3; ++v) {
      const auto at = turned(2 * kPi / 3).place(kHand.data() + 3 * v);
      to.insert(to.end(), at.begin(), at.end());
    }
    const BodyPositions moved{0, std::span<const double>(to)};
    Frame frame;
    frame.bodies = {&moved, 1};
    const StepResult result = collider.step(frame).value();
    found.emplace_back(result.contacts.begin(), result.contacts.end());
  }
  EXPECT_EQ(found[0], found[1]);
}

TEST(ScrewBodies, FieldsAreThoseOfWhereItIsThen) {
  Collider collider =
      made(hand_and(3, true), kThree, {.min_separation = 0.01, .fields = {.points = true}}).value();
  const StepResult result = step_of(collider, 2 * kPi / 3);
  ASSERT_FALSE(result.geometry.empty());
  const auto& points = result.geometry[0].points;
  for (std::size_t k = 0; k < 3; ++k) EXPECT_NEAR(points[k], kThree[k], 1e-9);  // the point that rests
  EXPECT_NEAR(std::hypot(points[3] - points[0], points[4] - points[1]), 0.01,
              1e-4);  // the hand, as near as that
}

TEST(ScrewBodies, WhatCannotBeIsRefused) {
  const auto refusal = [](Body body) {
    SceneDescription scene = hand_and(3, false);
    body.vertex_count = 3;
    scene.bodies[0] = body;
    const Result<Scene> result = Scene::create(scene);
    return result ? "" : result.error().message;
  };
  Body soft{"", 0, 3, BodyKind::kDeformable};
  soft.screw = true;
  EXPECT_THAT(refusal(soft), HasSubstr("bodies[0].screw: the body is not rigid"));
  soft.kind = BodyKind::kRemoved;
  EXPECT_EQ(refusal(soft), "");

  const Result<Collider> exact = made(hand_and(3, true), kThree, {.tier = Tier::kExact});
  ASSERT_FALSE(exact.ok());
  EXPECT_EQ(exact.error().code, ErrorCode::kInvalidArgument);
  EXPECT_THAT(exact.error().message, HasSubstr("tier: \"exact\" decides motions along lines"));

  Collider collider = made(hand_and(3, true), kThree, {}).value();
  const BodyPose pose{0, turned(1)};
  Frame frame;
  frame.poses = {&pose, 1};
  const Result<StepResult> trial = collider.trial(frame, {.tier = Tier::kExact});
  ASSERT_FALSE(trial.ok());
  EXPECT_THAT(trial.error().message, HasSubstr("tier"));
  EXPECT_FALSE(collider.change_options({.tier = Tier::kExact}).ok());
  EXPECT_TRUE(collider.proximity(0.1, Where::kBase, {.tier = Tier::kExact}).ok());  // of an instant

  // Of another kind it may have that tier, and then not turn again.
  Body lines = collider.scene().bodies()[0];
  lines.screw = false;
  ASSERT_TRUE(collider.change_body(0, lines).ok());
  ASSERT_TRUE(collider.change_options({.tier = Tier::kExact}).ok());
  lines.screw = true;
  EXPECT_FALSE(collider.change_body(0, lines).ok());
  EXPECT_FALSE(collider.scene().bodies()[0].screw);
}

}  // namespace
}  // namespace warmfront

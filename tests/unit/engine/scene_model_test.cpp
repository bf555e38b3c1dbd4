// SPDX-License-Identifier: Apache-2.0
// Further guarantees of a scene's model: excluded work costs nothing, and invalid input is named.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "engine/collider.h"
#include "tests/support/scenes.h"

namespace warmfront {
namespace {

using ::testing::HasSubstr;
using Doubles = std::span<const double>;

/// A row of octahedra, so near that neighbours touch, as bodies of their own.
struct Row {
  explicit Row(std::uint32_t count, BodyKind kind = BodyKind::kDeformable) {
    for (std::uint32_t b = 0; b < count; ++b) {
      for (auto face : testing::octahedron()) {
        for (auto& v : face) v += static_cast<std::int32_t>(6 * b);
        description.faces.push_back(face);
      }
      description.bodies.push_back({"", 6 * b, 6, kind});
      for (int axis = 0; axis < 3; ++axis) {
        for (const double sign : {-1.0, 1.0}) {
          for (int k = 0; k < 3; ++k) x.push_back((k == axis ? sign : 0) + (k == 0 ? 1.9 * b : 0));
        }
      }
    }
    description.vertex_count = 6 * count;
  }

  Collider collider(ColliderOptions options = {}) const {
    auto scene = std::make_shared<const Scene>(Scene::create(description).value());
    return Collider::create(scene, Doubles(x), options, std::make_shared<Workers>(2)).value();
  }
  /// With body b moved.
  std::vector<double> shifted(std::uint32_t b, double by) const {
    std::vector<double> moved = x;
    for (std::size_t i = 18 * b; i < 18 * b + 18; i += 3) moved[i + 1] += by;
    return moved;
  }

  SceneDescription description;
  std::vector<double> x;
};

Frame only(std::span<const std::uint32_t> vertices, Doubles to) {
  Frame frame;
  frame.vertices = vertices;
  frame.vertex_positions = to;
  return frame;
}

TEST(SceneModel, ARestingSceneIsNotLookedAtAndKeepsItsContacts) {
  const Row row(20);
  Collider collider = row.collider();
  const StepResult first = collider.step(Doubles(row.x)).value();
  const std::vector<Contact> contacts(first.contacts.begin(), first.contacts.end());
  ASSERT_GT(contacts.size(), 50U);
  static_cast<void>(collider.step(Doubles(row.x)).value());
  const StepResult third = collider.step(Doubles(row.x)).value();
  EXPECT_TRUE(std::ranges::equal(third.contacts, contacts));
  const StepCounts& counts = third.statistics.counts;
  EXPECT_EQ(counts.contacts_kept, contacts.size());
  EXPECT_EQ(counts.elementary_tests, 0U);
  EXPECT_EQ(counts.bv_tests, 0U);
  EXPECT_EQ(counts.nodes_refit, 0U);
  EXPECT_EQ(counts.vertices_moved, 0U);
  EXPECT_EQ(counts.front_rested, counts.front_pairs);
  EXPECT_EQ(counts.triangle_pairs, first.statistics.counts.triangle_pairs);
}

TEST(SceneModel, OneBodyThatMovesCostsOneBodysWork) {
  const Row row(50);
  Collider collider = row.collider();
  for (int k = 0; k < 3; ++k) static_cast<void>(collider.step(Doubles(row.x)).value());
  const std::vector<double> moved = row.shifted(25, 0.01);
  const StepCounts counts = collider.step(Doubles(moved)).value().statistics.counts;
  EXPECT_EQ(counts.parts_moved, 1U);
  EXPECT_EQ(counts.vertices_moved, 6U);
  EXPECT_EQ(counts.nodes_refit, 1U) << "of leaves of eight triangles";
  EXPECT_LT(counts.bv_tests, 40U);
}

TEST(SceneModel, StaticBodiesAreNeverPairedNorRefit) {
  Row row(10, BodyKind::kStatic);
  row.description.bodies[4].kind = BodyKind::kRigid;
  Collider collider = row.collider();
  static_cast<void>(collider.step(Doubles(row.x)).value());
  const StepCounts counts = collider.step(Doubles(row.shifted(4, 0.01))).value().statistics.counts;
  EXPECT_EQ(counts.near_parts, 2U) << "its two neighbours";
  EXPECT_EQ(counts.nodes_refit, 1U);
  EXPECT_EQ(counts.part_pairs_excluded, 10U + 9 * 8 / 2);
  EXPECT_EQ(counts.orphan_tests, 0U);
}

TEST(SceneModel, ARigidBodyThatNothingIsNearIsKnownByItsBall) {
  Row row(3, BodyKind::kRigid);
  for (std::size_t i = 0; i < row.x.size(); ++i)
    row.x[i] += i % 3 == 0 ? 10.0 * static_cast<double>(i / 18) : 0;
  Collider collider = row.collider();
  static_cast<void>(collider.step(Doubles(row.x)).value());
  Pose away;
  away.matrix[7] = 3;
  const BodyPose pose{1, away};
  Frame frame;
  frame.poses = {&pose, 1};
  const StepCounts counts = collider.step(frame).value().statistics.counts;
  EXPECT_EQ(counts.nodes_refit, 0U);
  EXPECT_EQ(counts.vertices_moved, 6U);
  EXPECT_EQ(collider.positions()[3 * 6 + 1], row.x[3 * 6 + 1] + 3);
}

TEST(SceneModel, ABodyThatIsAddedLeavesTheRestWarm) {
  const Row row(40);
  Collider collider = row.collider();
  for (int k = 0; k < 3; ++k) static_cast<void>(collider.step(Doubles(row.x)).value());
  const Row one(1);
  std::vector<double> far = one.x;
  for (std::size_t i = 1; i < far.size(); i += 3) far[i] += 30;
  BodyAddition addition;
  addition.body.vertex_count = 6;
  addition.faces = testing::octahedron();
  ASSERT_EQ(collider.add_body(addition, Doubles(far)).value(), 40U);
  const StepResult step = collider.step(Frame(only({}, {}))).value();
  EXPECT_EQ(step.statistics.front_state, FrontState::kUpdated);
  EXPECT_LE(step.statistics.counts.nodes_refit, 1U);
  EXPECT_LE(step.statistics.counts.elementary_tests, 64U) << "its own";
  EXPECT_EQ(collider.scene().body_count(), 41U);
  ASSERT_TRUE(collider.change_body(40, {"new", 0, 6, BodyKind::kRemoved}).ok());
  const StepResult without = collider.step(only({}, {})).value();
  EXPECT_EQ(without.statistics.front_state, FrontState::kUpdated);
  EXPECT_EQ(without.statistics.counts.elementary_tests, 0U);
  EXPECT_THAT(collider.change_body(40, {"new", 0, 6}).error().message, HasSubstr("was removed"));
}

TEST(SceneModel, ContactsAreDescribedWhereAsked) {
  Row row(6);
  EXPECT_TRUE(row.collider().step(Doubles(row.shifted(2, 0.3))).value().geometry.empty());
  ColliderOptions options;
  options.fields.normal = true;
  Collider collider = row.collider(options);
  const std::vector<double> end = row.shifted(2, 0.9);
  const StepResult step = collider.step(Doubles(end)).value();
  ASSERT_EQ(step.geometry.size(), step.contacts.size());
  ASSERT_GT(step.contacts.size(), 10U);
  for (std::size_t i = 0; i < step.contacts.size(); ++i) {
    const Contact& contact = step.contacts[i];
    const ContactGeometry& geometry = step.geometry[i];
    const auto v = collider.scene().vertices_of(contact);
    const std::size_t of_a = contact.kind == ContactKind::kVertexFace ? 1 : 2;
    double weights_a = 0;
    double weights_b = 0;
    double length = 0;
    for (std::size_t k = 0; k < 4; ++k) (k < of_a ? weights_a : weights_b) += geometry.weights[k];
    EXPECT_NEAR(weights_a, 1, 1e-12);
    EXPECT_NEAR(weights_b, 1, 1e-12);
    for (int axis = 0; axis < 3; ++axis) {
      double a = 0;
      double b = 0;
      for (std::size_t k = 0; k < 4; ++k) {
        const std::size_t at = 3 * v[k] + axis;
        (k < of_a ? a : b) += geometry.weights[k] * (row.x[at] + contact.toi * (end[at] - row.x[at]));
      }
      EXPECT_NEAR(a, geometry.points[axis], 1e-12);
      EXPECT_NEAR(b, geometry.points[3 + axis], 1e-12);
      EXPECT_NEAR(a, b, 1e-5) << "they touch";
      length += geometry.normal[axis] * geometry.normal[axis];
    }
    EXPECT_TRUE(std::fabs(length - 1) < 1e-12 || length == 0) << length;
  }
}

TEST(SceneModel, WhatDoesNotFitIsNamedAndTheSceneGoesOn) {
  Row row(4, BodyKind::kRigid);
  row.description.bodies[0].kind = BodyKind::kStatic;
  row.description.bodies[3].kind = BodyKind::kDeformable;
  Collider collider = row.collider();
  const auto error = [&](const Frame& frame) {
    const auto result = collider.step(frame);
    return result.ok() ? "" : result.error().message;
  };
  EXPECT_THAT(error(Doubles(row.shifted(0, 1))), HasSubstr("positions[0].y: moves, but body 0 is static"));

  Frame frame;
  BodyPose pose{1, {}};
  frame.poses = {&pose, 1};
  pose.pose.matrix[3] = std::nan("");
  EXPECT_THAT(error(frame), HasSubstr("poses[0]: body 1: pose[3]: is not a number"));
  pose.pose = {};
  pose.pose.matrix[0] = 1.1;
  EXPECT_THAT(error(frame), HasSubstr("poses[0]: body 1: pose: is not rigid"));
  pose.pose.matrix[0] = -1;
  EXPECT_THAT(error(frame), HasSubstr("mirrors"));
  pose = {3, {}};
  EXPECT_THAT(error(frame), HasSubstr("poses[0]: body 3 is not rigid"));
  pose = {4, {}};
  EXPECT_THAT(error(frame), HasSubstr("poses[0]: body 4 is not in [0, 4)"));
  const BodyPose twice[]{{1, {}}, {1, {}}};
  frame.poses = twice;
  EXPECT_THAT(error(frame), HasSubstr("poses[1]: body 1 is given twice"));

  const std::vector<double> at{0, 0, 0};
  const std::uint32_t beyond[]{24};
  EXPECT_THAT(error(only(beyond, at)), HasSubstr("vertices[0]: vertex 24 is not in [0, 24)"));
  const std::uint32_t rigid[]{7};
  EXPECT_THAT(error(only(rigid, at)), HasSubstr("vertex 7 is of the rigid body 1"));
  const std::uint32_t fixed[]{3};
  EXPECT_THAT(error(only(fixed, at)), HasSubstr("body 0 is static"));
  const std::uint32_t same[]{20, 20};
  EXPECT_THAT(error(only(same, std::vector<double>(6))), HasSubstr("vertices[1]: vertex 20 is named twice"));
  const std::uint32_t good[]{20};
  EXPECT_THAT(error(only(good, std::vector<double>(6))), HasSubstr("vertex_positions: 6 values"));
  const BodyPositions body{2, Doubles(at)};
  Frame bodies;
  bodies.bodies = {&body, 1};
  EXPECT_THAT(error(bodies), HasSubstr("bodies[0]: body 2: positions: 3 values where 18 are expected"));
  bodies.positions = Doubles(row.x);
  EXPECT_THAT(error(bodies), HasSubstr("give only one of them"));

  EXPECT_THAT(collider.change_body(9, {}).error().message, HasSubstr("body 9 is not in [0, 4)"));
  Body unmasked;
  unmasked.mask = 0;
  EXPECT_THAT(collider.change_body(1, unmasked).error().message, HasSubstr("bodies[1].mask: is 0"));
  EXPECT_EQ(collider.positions(), row.x);
  EXPECT_EQ(error(only(good, at)), "");
}

}  // namespace
}  // namespace warmfront

// SPDX-License-Identifier: Apache-2.0
// Half-spaces as bodies of a scene: what meets them in every question, how they move, change, and are
// refused.
#include "engine/half_space.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "engine/collider.h"
#include "engine/continuity.h"
#include "engine/rows_by_vertex.h"
#include "engine/stencil.h"
#include "tests/support/poses.h"
#include "tests/support/scenes.h"

namespace warmfront {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using testing::shifted;
using testing::turned_about_x;
using Doubles = std::span<const double>;

Body ground(BodyKind kind = BodyKind::kStatic, const HalfSpace& half_space = {{0, 0, 0}, {0, 0, 2}}) {
  Body body{"ground", 0, 0, kind};
  body.half_space = half_space;
  return body;
}

Collider make(SceneDescription description, const std::vector<double>& x, ColliderOptions options = {}) {
  auto scene = Scene::create(std::move(description));
  if (!scene) throw std::runtime_error(scene.error().message);
  auto collider = Collider::create(std::make_shared<const Scene>(std::move(scene).value()), Doubles(x),
                                   options, std::make_shared<Workers>(2));
  if (!collider) throw std::runtime_error(collider.error().message);
  return std::move(collider).value();
}

/// Ground z <= 0, body 0; body 1: a triangle (0, 1, 2), an edge (3, 4) and a point 5, at heights 1, 2 and 3.
struct Falling {
  SceneDescription scene{
      .vertex_count = 6, .faces = {{0, 1, 2}}, .bodies = {ground(), {"things", 0, 6}}, .edges = {{3, 4}}};
  std::vector<double> x{0, 0, 1, 1, 0, 1, 0, 1, 1, 5, 0, 2, 6, 0, 2, 9, 0, 3};

  std::vector<double> lowered(double by) const {
    std::vector<double> y = x;
    for (std::size_t i = 2; i < y.size(); i += 3) y[i] -= by;
    return y;
  }
};

TEST(HalfSpaces, EveryVertexMeetsOne) {
  for (const Tier tier : {Tier::kFast, Tier::kCertified, Tier::kExact}) {
    Falling falling;
    Collider collider = make(
        falling.scene, falling.x,
        {.tier = tier,
         .fields = {
             .weights = true, .normal = true, .points = true, .direction = true, .squared_distance = true}});
    EXPECT_EQ(collider.step(Doubles(falling.lowered(0.5))).value().total(), 0U);
    const StepResult met = collider.step(Doubles(falling.lowered(2.5))).value();
    ASSERT_EQ(met.vh, 5U);
    EXPECT_EQ(met.total(), 5U);
    ASSERT_EQ(met.contacts.size(), 5U);
    for (std::uint32_t v = 0; v < 5; ++v) {
      const Contact& contact = met.contacts[v];
      EXPECT_EQ(contact.kind, ContactKind::kVertexHalfSpace);
      EXPECT_EQ(contact.a, v);
      EXPECT_EQ(contact.b, 0U);
      EXPECT_THAT(collider.scene().vertices_of(contact), ElementsAre(v, v, v, 0));
      const double expected = v < 3 ? 0.25 : 0.75;
      if (tier == Tier::kExact) {
        EXPECT_EQ(contact.toi, expected);
      } else {
        EXPECT_NEAR(contact.toi, expected, 1e-12);
      }
      EXPECT_LE(contact.toi, expected);
      EXPECT_EQ(contact.status, ContactStatus::kHit);
      const ContactGeometry& geometry = met.geometry[v];
      EXPECT_THAT(geometry.weights, ElementsAre(1, 0, 0, 0));
      EXPECT_THAT(geometry.normal, ElementsAre(0, 0, 1));
      EXPECT_NEAR(geometry.points[2], 0, 1e-12);
      EXPECT_NEAR(geometry.points[5], 0, 1e-12);
      EXPECT_EQ(geometry.points[0], falling.x[std::size_t{3} * v]);
      EXPECT_NEAR(geometry.squared_distance, 0, 1e-20);
    }
    // What is inside stays in contact, also where nothing moves.
    const StepResult rest = collider.step(Frame()).value();
    EXPECT_EQ(rest.vh, 5U);
    EXPECT_EQ(rest.earliest_toi, 0.0);
    EXPECT_EQ(rest.contacts[0].status, ContactStatus::kOverlapAtStart);
    EXPECT_TRUE(collider.self_check().ok());
  }
}

TEST(HalfSpaces, MoveByPosesAndStayWithAllPositions) {
  Falling falling;
  falling.scene.bodies[0].kind = BodyKind::kRigid;
  Collider collider = make(falling.scene, falling.x, {.tier = Tier::kExact});
  const auto to = [&](const Pose& pose) {
    const std::array<BodyPose, 1> poses{{{0, pose}}};
    Frame frame;
    frame.poses = poses;
    return collider.step(frame).value();
  };
  EXPECT_EQ(to(shifted(7, 0, 0.5)).vh, 0U);
  const StepResult risen = to(shifted(7, 0, 1.5));
  ASSERT_EQ(risen.vh, 3U);
  EXPECT_EQ(risen.contacts[0].toi, 0.5);
  // The frame has positions of vertices alone: the ground is where it was.
  EXPECT_EQ(collider.step(Doubles(falling.lowered(1))).value().vh, 5U);
  EXPECT_EQ(collider.step(Doubles(falling.x)).value().vh, 5U) << "the edge starts inside";
  EXPECT_EQ(to(shifted(0, 0, -1)).vh, 3U) << "inside at the start";
  EXPECT_EQ(to(shifted(0, 0, -1)).vh, 0U);
  // A tenth of a turn about the x axis: what is at y = 0 is left alone, and vertex 2 is not reached either.
  EXPECT_EQ(to(turned_about_x(0.1)).vh, 0U);
  // A half turn: all of space is inside when the normal is zero.
  Collider half = make(falling.scene, falling.x);
  const std::array<BodyPose, 1> poses{{{0, turned_about_x(std::acos(-1.0))}}};
  Frame frame;
  frame.poses = poses;
  const StepResult turned = half.step(frame).value();
  EXPECT_EQ(turned.vh, 6U);
  EXPECT_LE(*turned.earliest_toi, 0.5);
}

TEST(HalfSpaces, AreInTheAnswersOfAllQuestions) {
  Falling falling;
  falling.scene.bodies[0].kind = BodyKind::kRigid;
  falling.scene.bodies[0].thickness = 0.25;
  Collider collider = make(falling.scene, falling.x);
  EXPECT_EQ(collider.proximity(0.5).value().vh, 0U);
  EXPECT_EQ(collider.proximity(0.75).value().vh, 3U);
  EXPECT_EQ(collider.proximity(2).value().vh, 5U);
  const StepResult distances = collider.vertex_distances(2).value();
  ASSERT_EQ(distances.vertex_distances.size(), 6U);
  EXPECT_NEAR(distances.vertex_distances[0], 0.75, 1e-9);
  EXPECT_LE(distances.vertex_distances[0], 0.75);
  EXPECT_NEAR(distances.vertex_distances[3], 1.75, 1e-9);
  EXPECT_EQ(distances.vertex_distances[5], 2);
  const StepResult reduced = collider.proximity(2, Where::kBase, {.reduced = true}).value();
  ASSERT_EQ(reduced.closest_pairs.size(), 5U);
  EXPECT_EQ(reduced.closest_pairs[0], (ClosestPair{1, 0b0001}));

  const MaxStep far = collider.max_step(Doubles(falling.lowered(1.5))).value();
  EXPECT_NEAR(far.fraction, 0.5, 1e-9);
  ASSERT_TRUE(far.first);
  EXPECT_EQ(far.first->kind, ContactKind::kVertexHalfSpace);
  const MaxStep kept =
      collider.max_step(Doubles(falling.lowered(1.5)), false, {.keep_distance = 0.5}).value();
  EXPECT_NEAR(kept.fraction, 0.25, 1e-3);

  const StepResult trial = collider.trial(Doubles(falling.lowered(1))).value();
  EXPECT_EQ(trial.vh, 3U);
  EXPECT_EQ(collider.proximity(0, Where::kTrialEnd).value().vh, 3U);
  EXPECT_EQ(collider.intersections(Where::kTrialEnd).value().total(), 0U) << "of triangles alone";
  const CommitResult half = collider.commit(0.5).value();
  EXPECT_EQ(half.vh, 0U);
  EXPECT_EQ(collider.step(Doubles(falling.lowered(1))).value().vh, 3U);
  EXPECT_EQ(collider.step(Frame(), nullptr, {}, {.report = Report::kCount}).value().vh, 3U);
  EXPECT_EQ(collider.step(Frame(), nullptr, {}, {.report = Report::kEarliest}).value().contacts.size(), 3U);
  const StepResult candidates = collider.step(Frame(), nullptr, {}, {.report = Report::kCandidates}).value();
  ASSERT_EQ(candidates.contacts.size(), 3U);
  EXPECT_EQ(candidates.contacts[0].status, ContactStatus::kBudget);
  EXPECT_EQ(collider.step(Frame(), nullptr, {}, {.max_contacts = 2}).error().code,
            ErrorCode::kResourceExhausted);
}

// A trial, and a shorter one of the same motion of vertices, for which the half-space moves otherwise.
TEST(HalfSpaces, AreTestedAgainInEachTrial) {
  Falling falling;
  falling.scene.bodies[0].kind = BodyKind::kRigid;
  Collider collider = make(falling.scene, falling.x);
  const auto trial = [&](double by, double rise) {
    const std::array<BodyPose, 1> poses{{{0, shifted(0, 0, rise)}}};
    const std::vector<double> y = falling.lowered(by);
    const std::array<BodyPositions, 1> bodies{{{1, Doubles(y)}}};
    Frame frame;
    frame.poses = poses;
    frame.bodies = bodies;
    return collider.trial(frame).value().vh;
  };
  EXPECT_EQ(trial(0.5, 0), 0U);
  EXPECT_EQ(trial(0.25, 0.8), 3U);
  EXPECT_EQ(trial(0.25, 0.7), 0U);
  EXPECT_EQ(trial(0.125, 2), 5U);
  EXPECT_TRUE(collider.commit(1).ok());
  EXPECT_EQ(collider.step(Frame()).value().vh, 5U);
}

TEST(HalfSpaces, MeetWhatTheModelAllows) {
  Falling falling;
  // A second body, static, within the ground; and a second ground, rigid, that meets it.
  falling.scene.vertex_count = 7;
  falling.x.insert(falling.x.end(), {20, 0, -1});
  falling.scene.bodies.push_back({"stone", 6, 1, BodyKind::kStatic});
  Body other = ground(BodyKind::kRigid);
  other.first_vertex = 7;
  other.thickness = 1;
  falling.scene.bodies.push_back(other);
  EXPECT_EQ(make(falling.scene, falling.x).step(Frame()).value().vh, 4U)
      << "not static and static, nor a half-space and another: 0, 1 and 2 touch the thick one";
  falling.scene.excluded_pairs = {{1, 3}};
  EXPECT_EQ(make(falling.scene, falling.x).step(Frame()).value().vh, 1U);
  falling.scene.excluded_pairs.clear();
  falling.scene.bodies[3].mask = 2;
  EXPECT_EQ(make(falling.scene, falling.x).step(Frame()).value().vh, 0U);
}

TEST(HalfSpaces, AreAddedChangedAndRemoved) {
  Falling falling;
  falling.scene.bodies.erase(falling.scene.bodies.begin());
  falling.scene.bodies[0].first_vertex = 0;
  Collider collider = make(falling.scene, falling.x);
  EXPECT_EQ(collider.add_body({ground(BodyKind::kRigid), {}}, Doubles()).value(), 1U);
  EXPECT_EQ(collider.step(Doubles(falling.lowered(1))).value().vh, 3U);
  // Elsewhere by its description, without a motion; and its pose is the identity again.
  const std::array<BodyPose, 1> down{{{1, shifted(0, 0, -9)}}};
  Frame frame;
  frame.poses = down;
  ASSERT_TRUE(collider.place(frame).ok());
  EXPECT_EQ(collider.step(Frame()).value().vh, 0U);
  Body higher = ground(BodyKind::kRigid, {{0, 0, 1}, {0, 0, 1}});
  ASSERT_TRUE(collider.change_body(1, higher).ok());
  EXPECT_EQ(collider.step(Frame()).value().vh, 5U);
  // Another name leaves it at its pose.
  ASSERT_TRUE(collider.place(frame).ok());
  higher.name = "floor";
  ASSERT_TRUE(collider.change_body(1, higher).ok());
  EXPECT_EQ(collider.step(Frame()).value().vh, 0U);
  // So does a body that is added after it.
  ASSERT_TRUE(collider.add_body({{"more", 0, 1}, {}}, Doubles(std::vector<double>{0, 0, 5})).ok());
  EXPECT_EQ(collider.step(Frame()).value().vh, 0U);
  Body fixed = higher;
  fixed.kind = BodyKind::kStatic;
  ASSERT_TRUE(collider.change_body(1, fixed).ok());
  EXPECT_EQ(collider.step(Frame()).value().vh, 5U) << "where its description says";
  Body lacking = fixed;
  lacking.half_space.reset();
  EXPECT_THAT(collider.change_body(1, lacking).error().message, HasSubstr("half_space: is missing"));
  lacking.kind = BodyKind::kRemoved;
  ASSERT_TRUE(collider.change_body(1, lacking).ok());
  EXPECT_EQ(collider.step(Frame()).value().vh, 0U);
  Body mesh{"things", 0, 6};
  mesh.kind = BodyKind::kStatic;
  mesh.half_space = HalfSpace{{0, 0, 0}, {0, 0, 1}};
  EXPECT_THAT(collider.change_body(0, mesh).error().message, HasSubstr("the body has 6 vertices"));
}

// More bodies than are near, most of them known by their poses alone.
TEST(HalfSpaces, MeetBodiesKnownByTheirPosesAlone) {
  SceneDescription scene;
  std::vector<double> x;
  constexpr int kBodies = 40;
  for (int b = 0; b < kBodies; ++b) {
    for (const auto& face : testing::tetrahedron())
      scene.faces.push_back({face[0] + 4 * b, face[1] + 4 * b, face[2] + 4 * b});
    scene.bodies.push_back({"", static_cast<std::uint32_t>(4 * b), 4, BodyKind::kRigid});
    for (const double c : {0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0})
      x.push_back(c + (x.size() % 3 == 0 ? 3.0 * b : 0) + (x.size() % 3 == 2 ? 1 : 0));
  }
  scene.vertex_count = 4 * kBodies;
  scene.bodies.push_back(ground());
  scene.bodies.back().first_vertex = scene.vertex_count;
  for (const bool separates : {false, true}) {
    Collider collider = make(scene, x, {.tier = Tier::kExact, .separate_parts = separates});
    for (int step = 1; step < 6; ++step) {
      std::vector<BodyPose> poses;
      for (std::uint32_t b = 0; b < kBodies; ++b)
        poses.push_back({b, shifted(0, 0, b % 3 == 0 ? -0.3 * step : 0)});
      Frame frame;
      frame.poses = poses;
      const StepResult met =
          collider.step(frame, nullptr, {}, {.fields = ContactFields{.points = true}}).value();
      EXPECT_EQ(met.vh, step < 4 ? 0U : 14U * 3) << step;
      if (step == 4) {
        EXPECT_NEAR(met.geometry[0].points[2], 0, 1e-12);
      }
      EXPECT_TRUE(collider.self_check().ok());
    }
  }
}

TEST(HalfSpaces, AreRefusedWhereTheyMakeNoSense) {
  const auto refused = [](auto&& spoil) {
    Falling falling;
    spoil(falling.scene);
    auto scene = Scene::create(falling.scene);
    return scene.ok() ? std::string("accepted") : scene.error().message;
  };
  const auto first = [](SceneDescription& scene) -> Body& { return scene.bodies[0]; };
  EXPECT_THAT(refused([&](auto& s) { first(s).kind = BodyKind::kDeformable; }),
              HasSubstr("bodies[0].kind: is deformable"));
  EXPECT_THAT(refused([&](auto& s) { first(s).half_space->normal = {}; }), HasSubstr("normal: is zero"));
  EXPECT_THAT(refused([&](auto& s) { first(s).half_space->normal[1] = NAN; }), HasSubstr("normal.y"));
  EXPECT_THAT(refused([&](auto& s) { first(s).half_space->point[2] = INFINITY; }), HasSubstr("point.z"));
  EXPECT_THAT(refused([&](auto& s) { first(s).half_space.reset(); }), HasSubstr("vertex_count: is 0"));
  EXPECT_THAT(refused([&](auto& s) { s.bodies[1].half_space = first(s).half_space; }),
              HasSubstr("bodies[1].half_space"));
  EXPECT_THAT(refused([&](auto& s) { first(s).first_vertex = 3; }), HasSubstr("first_vertex"));

  Falling falling;
  falling.scene.bodies[0].kind = BodyKind::kRigid;
  Collider collider = make(falling.scene, falling.x);
  const std::array<BodyPositions, 1> bodies{{{0, Doubles()}}};
  Frame frame;
  frame.bodies = bodies;
  EXPECT_THAT(collider.step(frame).error().message, HasSubstr("is a half-space, which has no positions"));
  const std::array<BodyPose, 2> twice{{{0, {}}, {0, {}}}};
  frame = {};
  frame.poses = twice;
  EXPECT_THAT(collider.step(frame).error().message, HasSubstr("given twice"));
  frame.poses = std::span(twice).first(1);
  EXPECT_TRUE(collider.step(frame).ok());
  EXPECT_TRUE(collider.step(frame).ok()) << "once in each frame";
  falling.scene.bodies[0].kind = BodyKind::kStatic;
  EXPECT_THAT(make(falling.scene, falling.x).step(frame).error().message, HasSubstr("is static"));
}

// Alone, and beside nothing that it may meet.
TEST(HalfSpaces, MayBeTheOnlyBodies) {
  SceneDescription scene;
  scene.bodies = {ground(), ground(BodyKind::kRigid)};
  Collider collider = make(scene, {});
  EXPECT_EQ(collider.step(Frame()).value().total(), 0U);
  const std::array<BodyPose, 1> poses{{{1, shifted(1, 2, 3)}}};
  Frame frame;
  frame.poses = poses;
  EXPECT_EQ(collider.trial(frame).value().total(), 0U);
  EXPECT_TRUE(collider.commit(0.5).ok());
  EXPECT_TRUE(collider.self_check().ok());
}

TEST(HalfSpaces, RowsNameTheVertexAndTheBody) {
  const std::array<std::array<std::uint32_t, 4>, 2> rows{{{4, 1, 2, 3}, {4, 4, 4, 9}}};
  const RowsByVertex by_vertex = rows_by_vertex(rows, 5).value();
  EXPECT_THAT(by_vertex[4], ElementsAre(0, 1));
  const Stencil stencil = stencil_of(ContactKind::kVertexHalfSpace, rows[1], 0b0001);
  EXPECT_EQ(stencil.size, 1);
  EXPECT_EQ(stencil.vertices[0], 4U);
  const std::array kinds{ContactKind::kVertexFace, ContactKind::kVertexHalfSpace};
  const Continuity same = continuity(RowVertices{kinds, rows, {}}, RowVertices{kinds, rows, {}});
  EXPECT_THAT(same.earlier, ElementsAre(0, 1));
}

}  // namespace
}  // namespace warmfront

// SPDX-License-Identifier: Apache-2.0
// Edges of no face, hair and rods: what they meet in a step, near a state and through faces, alone, on a mesh
// and beside it; with few vertices moved, in rigid bodies, and when they are added to a scene.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "engine/collider.h"
#include "tests/support/scenes.h"

namespace warmfront {
namespace {

using ::testing::ElementsAre;
using Doubles = std::span<const double>;

Collider make(SceneDescription description, const std::vector<double>& x, ColliderOptions options = {}) {
  auto scene = Scene::create(std::move(description));
  if (!scene) throw std::runtime_error(scene.error().message);
  return Collider::create(std::make_shared<const Scene>(std::move(scene).value()), Doubles(x), options,
                          std::make_shared<Workers>(2))
      .value();
}

/// Two rods, one along x and one along y above it.
struct Cross {
  SceneDescription scene{.vertex_count = 4, .faces = {}, .bodies = {}, .edges = {{0, 1}, {2, 3}}};
  std::vector<double> x{-1, 0, 0, 1, 0, 0, 0, -1, 1, 0, 1, 1};

  /// With the second one at this height.
  std::vector<double> at(double z) const {
    std::vector<double> y = x;
    y[8] = y[11] = z;
    return y;
  }
};

TEST(LoneEdges, MeetInAllTiers) {
  const Cross cross;
  for (const Tier tier : {Tier::kFast, Tier::kCertified, Tier::kExact}) {
    Collider collider = make(cross.scene, cross.x, {.tier = tier});
    EXPECT_EQ(collider.step(Doubles(cross.at(0.5))).value().ee, 0U);
    const StepResult met = collider.step(Doubles(cross.at(-0.5))).value();
    ASSERT_EQ(met.contacts.size(), 1U);
    EXPECT_EQ(met.contacts[0].kind, ContactKind::kEdgeEdge);
    EXPECT_NEAR(met.contacts[0].toi, 0.5, 1e-5);
    EXPECT_EQ(met.statistics.counts.triangle_pairs, 1U) << "two lone edges count as two triangles do";
  }
}

TEST(LoneEdges, AreNearEachOtherAsSegmentsAre) {
  const Cross cross;
  Collider collider = make(cross.scene, cross.x);
  EXPECT_EQ(collider.proximity(0.99).value().ee, 0U);
  EXPECT_EQ(collider.proximity(1).value().ee, 1U);
  // End to end: what is closest are vertices.
  Collider in_line = make(cross.scene, {0, 0, 0, 1, 0, 0, 1.5, 0, 0, 3, 0, 0});
  EXPECT_EQ(in_line.proximity(0.49).value().ee, 0U);
  EXPECT_EQ(in_line.proximity(0.5).value().ee, 1U);
}

TEST(LoneEdges, PierceFaces) {
  SceneDescription scene{.vertex_count = 6, .faces = {{0, 1, 2}}, .bodies = {}, .edges = {{3, 4}, {4, 5}}};
  Collider collider = make(scene, {0, 0, 0, 1, 0, 0, 0, 1, 0, 0.2, 0.2, 1, 0.2, 0.2, -1, 3, 3, -1});
  const StepResult meeting = collider.intersections().value();
  ASSERT_EQ(meeting.contacts.size(), 1U);
  const Contact& contact = meeting.contacts[0];
  EXPECT_EQ(contact.kind, ContactKind::kEdgeFace);
  EXPECT_THAT(collider.scene().edge_face_vertices_of(contact), ElementsAre(3, 4, 0, 1, 2));
}

// The tip of a hair whose root is a vertex of the face that it folds onto: all that the hierarchy offers is a
// segment and a face that share a vertex.
TEST(LoneEdges, FoldOntoTheFaceThatTheyGrowFrom) {
  SceneDescription scene{.vertex_count = 4, .faces = {{0, 1, 2}}, .bodies = {}, .edges = {{0, 3}}};
  std::vector<double> x{0, 0, 0, 1, 0, 0, 0, 1, 0, 0.2, 0.2, 1};
  for (const FrontMode front : {FrontMode::kNone, FrontMode::kPaper, FrontMode::kWarm}) {
    Collider collider = make(scene, x, {.front = front});
    std::vector<double> folded = x;
    folded[11] = -1;
    const StepResult met = collider.step(Doubles(folded)).value();
    ASSERT_EQ(met.contacts.size(), 1U) << "its tip; with the face's opposite side it meets nothing";
    EXPECT_THAT(collider.scene().vertices_of(met.contacts[0]), ElementsAre(3, 0, 1, 2));
    // Outwards across the opposite side.
    std::vector<double> across{0, 0, 0, 1, 0, 0, 0, 1, 0, 2, 2, -1};
    ASSERT_TRUE(make(scene, x).step(Doubles(across)).ok());
    Collider outside = make(scene, {0, 0, 0, 1, 0, 0, 0, 1, 0, 2, 2, 1});
    const StepResult swept = outside.step(Doubles(across)).value();
    ASSERT_EQ(swept.contacts.size(), 1U);
    EXPECT_EQ(swept.contacts[0].kind, ContactKind::kEdgeEdge);
  }
}

TEST(LoneEdges, AStrandIsTestedAgainstItselfButNotItsNeighbours) {
  // Five edges along x.
  SceneDescription scene{.vertex_count = 6, .faces = {}, .bodies = {}};
  std::vector<double> x;
  for (int v = 0; v < 6; ++v) x.insert(x.end(), {double(v), 0, 0});
  for (int v = 0; v < 5; ++v) scene.edges.push_back({v, v + 1});
  Collider collider = make(scene, x);
  EXPECT_EQ(collider.proximity(1).value().ee, 3U) << "those with one edge in between";
  EXPECT_EQ(collider.proximity(0.5).value().ee, 0U);
  ASSERT_TRUE(collider.change_filters({.within_edges = 1}).ok());
  EXPECT_EQ(collider.proximity(2.5).value().ee, 2U) << "those with two edges in between";
}

TEST(LoneEdges, OfWhichFewVerticesMoveAreRefitAlone) {
  // A hundred rods side by side, of which one is lifted over its neighbour.
  SceneDescription scene{.vertex_count = 200, .faces = {}, .bodies = {}};
  std::vector<double> x;
  for (int rod = 0; rod < 100; ++rod) {
    scene.edges.push_back({2 * rod, 2 * rod + 1});
    x.insert(x.end(), {0.1 * rod, 0, 0, 0.1 * rod, 1, 0});
  }
  Collider collider = make(scene, x);
  ASSERT_TRUE(collider.step(Doubles(x)).ok());
  const std::vector<std::uint32_t> vertices{100, 101};
  const std::vector<double> to{5, 0, 0.05, 5.15, 1, 0};
  Frame frame;
  frame.vertices = vertices;
  frame.vertex_positions = Doubles(to);
  const StepResult moved = collider.step(frame).value();
  ASSERT_EQ(moved.contacts.size(), 1U);
  EXPECT_THAT(collider.scene().vertices_of(moved.contacts[0]), ElementsAre(100, 101, 102, 103));
  EXPECT_LT(moved.statistics.counts.nodes_refit, 12U) << "a leaf and what is above it";
  EXPECT_TRUE(collider.self_check().ok());
}

TEST(LoneEdges, OfRigidBodiesAndOfThoseThatAreAdded) {
  const Cross cross;
  SceneDescription scene = cross.scene;
  scene.bodies = {{"below", 0, 2, BodyKind::kStatic}, {"above", 2, 2, BodyKind::kRigid}};
  Collider collider = make(scene, cross.x);
  BodyAddition third{{"third", 0, 3}, {}, {{0, 1}, {1, 2}}};
  const std::vector<double> place{-1, 0.5, 2, 1, 0.5, 2, 2, 0.5, 2};
  ASSERT_TRUE(collider.add_body(third, Doubles(place)).ok());
  EXPECT_EQ(collider.scene().lone_edges().size(), 4U);
  Pose down;
  down.matrix[11] = -1.5;
  const std::vector<BodyPose> poses{{1, down}};
  Frame frame;
  frame.poses = poses;
  EXPECT_EQ(collider.step(frame).value().ee, 1U) << "the one below";
  Pose up;
  up.matrix[11] = 1.5;
  const std::vector<BodyPose> lifted{{1, up}};
  frame.poses = lifted;
  EXPECT_EQ(collider.step(frame).value().ee, 2U) << "below, and the one that was added";
  EXPECT_TRUE(collider.self_check().ok());
}

// Whether anything is tangled at the end of a trial is asked of edges and faces alone; a trial after it, part
// of the same way, is of points, too, where these are thick. A rod and two points rest, and a face moves.
TEST(LoneEdges, AndPointsAreMetByTrialsAfterWhatIsTangledWasAsked) {
  const SceneDescription scene{.vertex_count = 7,
                               .faces = {{4, 5, 6}},
                               .bodies = {{"rod", 0, 4}, {"face", 4, 3}},
                               .thickness = {0.1, 0.1, 0.1, 0.1, 0, 0, 0},
                               .edges = {{0, 1}}};
  const std::vector<double> x{-1, 0, 0, 1, 0, 0, 0, 0, 0.15, 0.05, 0, 0.25, 0, 0, 1, 1, 0, 1, 0, 1, 1};
  Collider collider = make(scene, x);
  const auto met = [&](double rise) {
    std::vector<double> y = x;
    for (const std::size_t z : {14, 17, 20}) y[z] += rise;
    std::vector<ContactKind> kinds;
    const StepResult result = collider.trial(Doubles(y)).value();
    for (const Contact& contact : result.contacts) kinds.push_back(contact.kind);
    return kinds;
  };
  const auto expected = ElementsAre(ContactKind::kVertexEdge, ContactKind::kVertexVertex);
  for (const Report report : {Report::kAll, Report::kCount, Report::kAny}) {
    EXPECT_THAT(met(-0.01), expected);
    EXPECT_THAT(met(0.01), expected) << "by what was found of what rests";
    const StepResult tangled = collider.intersections(Where::kTrialEnd, {.report = report}).value();
    EXPECT_EQ(tangled.ef, 0U);
    EXPECT_FALSE(tangled.statistics.part_of_trial) << "else the test shows nothing";
    EXPECT_THAT(met(0.01), expected) << "after intersections";
  }
}

TEST(LoneEdges, OfAHubAreBounded) {
  constexpr std::uint32_t kSpokes = 3000;
  SceneDescription scene{.vertex_count = kSpokes + 1, .faces = {}, .bodies = {}};
  std::vector<double> x{0, 0, 0};
  for (std::uint32_t v = 1; v <= kSpokes; ++v) {
    scene.edges.push_back({0, static_cast<std::int32_t>(v)});
    x.insert(x.end(), {std::cos(0.002 * v), std::sin(0.002 * v), 1});
  }
  auto made = Scene::create(scene);
  ASSERT_TRUE(made.ok());
  const auto refused = Collider::create(std::make_shared<const Scene>(std::move(made).value()), Doubles(x),
                                        {}, std::make_shared<Workers>(2));
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, ErrorCode::kResourceExhausted);
  EXPECT_THAT(refused.error().message, ::testing::HasSubstr("vertex 0 alone is in 3000 faces and edges"));
}

}  // namespace
}  // namespace warmfront

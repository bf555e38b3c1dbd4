// SPDX-License-Identifier: Apache-2.0
// Bodies that are placed without a motion (teleport, reset): they meet nothing on the way, and everything
// where they are.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "engine/collider.h"
#include "tests/support/scenes.h"

namespace warmfront {
namespace {

using ::testing::HasSubstr;
using Doubles = std::span<const double>;

/// A triangle below, and one above it that falls through it or is put on its other side.
struct Falling {
  std::vector<double> at(double z) const {
    return {0, 0, 0, 1, 0, 0, 0, 1, 0, 0.2, 0.2, z, 0.4, 0.2, z, 0.2, 0.4, z};
  }
  Collider collider(ColliderOptions options = {}) const {
    const std::vector<double> x = at(1);
    return Collider::create(testing::make_scene(6, {{0, 1, 2}, {3, 4, 5}}), Doubles(x), options,
                            std::make_shared<Workers>(2))
        .value();
  }
};

TEST(Place, MeetsNothingOnTheWayAndEverythingFromThere) {
  const Falling falling;
  for (const FrontMode front : {FrontMode::kNone, FrontMode::kPaper, FrontMode::kWarm}) {
    Collider collider = falling.collider({.front = front});
    EXPECT_GT(collider.trial(Doubles(falling.at(-1))).value().vf, 0U);
    ASSERT_TRUE(collider.place(Doubles(falling.at(-1))).ok());
    EXPECT_EQ(collider.positions(), falling.at(-1));
    EXPECT_EQ(collider.commit().error().code, ErrorCode::kFailedPrecondition) << "the trial began elsewhere";
    EXPECT_EQ(collider.step(Doubles(falling.at(-0.5))).value().vf, 0U);
    EXPECT_GT(collider.step(Doubles(falling.at(0.5))).value().vf, 0U) << "back again it meets the triangle";
    ASSERT_TRUE(collider.place(Doubles(falling.at(0.001))).ok());
    EXPECT_EQ(collider.proximity(0.002).value().vf, 3U);
    EXPECT_EQ(collider.proximity(0.0005).value().vf, 0U);
    EXPECT_TRUE(collider.self_check().ok());
  }
}

// What trials cached for the former place is no longer valid.
TEST(Place, ByPosesAfterTrials) {
  const Falling falling;
  SceneDescription description{
      .vertex_count = 6,
      .faces = {{0, 1, 2}, {3, 4, 5}},
      .bodies = {{"below", 0, 3, BodyKind::kDeformable}, {"above", 3, 3, BodyKind::kRigid}}};
  const std::vector<double> x = falling.at(1);
  for (const bool separates : {false, true}) {
    Collider collider =
        Collider::create(std::make_shared<const Scene>(Scene::create(description).value()), Doubles(x),
                         {.min_separation = 1.5, .separate_parts = separates}, std::make_shared<Workers>(1))
            .value();
    ASSERT_TRUE(collider.trial(Doubles(x)).ok());
    std::vector<double> to = x;
    for (const int z : {2, 5, 8}) to[z] += 0.05;
    const QuestionOptions touching{.min_separation = 0};
    ASSERT_TRUE(collider.trial(Doubles(to), touching).ok());
    Pose down;
    down.matrix[11] = -0.98;
    const std::vector<BodyPose> poses{{1, down}};
    ASSERT_TRUE(collider.place(poses).ok());
    const std::vector<BodyPositions> below{{0, Doubles(to).first(9)}};
    Frame frame;
    frame.bodies = below;
    EXPECT_EQ(collider.step(frame, nullptr, {}, touching).value().vf, 3U);
    EXPECT_TRUE(collider.self_check().ok());
  }
}

TEST(Place, OfSomeBodiesAndPoses) {
  const Falling falling;
  SceneDescription description{
      .vertex_count = 6,
      .faces = {{0, 1, 2}, {3, 4, 5}},
      .bodies = {{"below", 0, 3, BodyKind::kDeformable}, {"above", 3, 3, BodyKind::kRigid}}};
  const std::vector<double> x = falling.at(1);
  Collider collider = Collider::create(std::make_shared<const Scene>(Scene::create(description).value()),
                                       Doubles(x), {}, std::make_shared<Workers>(2))
                          .value();
  Pose down;
  down.matrix[11] = -2;
  const std::vector<BodyPose> poses{{1, down}};
  Frame frame;
  frame.poses = poses;
  ASSERT_TRUE(collider.place(frame).ok());
  EXPECT_EQ(collider.positions(), falling.at(-1));
  EXPECT_EQ(collider.step(frame).value().vf, 0U) << "it stays";
  const std::vector<BodyPose> back{{1, Pose{}}};
  frame.poses = back;
  EXPECT_GT(collider.step(frame).value().vf, 0U) << "from the other side";
}

TEST(Place, ThatIsRefusedOrCancelledLeavesNoTrace) {
  const Falling falling;
  Collider collider = falling.collider();
  ASSERT_TRUE(collider.step(Doubles(falling.at(0.75))).ok());
  const std::vector<double> wrong(17);
  const Status refused = collider.place(Doubles(wrong));
  EXPECT_EQ(refused.error().code, ErrorCode::kInvalidArgument);
  const std::atomic<bool> stop{true};
  EXPECT_EQ(collider.place(Doubles(falling.at(-1)), &stop).error().code, ErrorCode::kCancelled);
  const Error no{ErrorCode::kAborted, "not now"};
  EXPECT_EQ(collider.place(Doubles(falling.at(-1)), nullptr, [&](const StepResult&) -> Status { return no; })
                .error()
                .code,
            ErrorCode::kAborted);
  EXPECT_EQ(collider.positions(), falling.at(0.75));
  EXPECT_GT(collider.step(Doubles(falling.at(-1))).value().vf, 0U) << "it falls from where it was";
  const auto asked = collider.ask(Doubles(falling.at(1)), {QuestionKind::kPlace, {.tier = Tier::kExact}});
  ASSERT_FALSE(asked.ok());
  EXPECT_THAT(asked.error().message, HasSubstr("place: it tests nothing, and has no options"));
}

// A commit of a part of a line from pose to pose leaves a matrix that is no rotation: it may be given again
// where the body is, and places another session's.
TEST(Place, AtWhatACommitLeft) {
  SceneDescription scene{7, {{0, 1, 2}, {3, 4, 5}, {4, 5, 6}}, {{"", 0, 3}, {"", 3, 4, BodyKind::kRigid}}};
  const std::vector<double> x{0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 1, 0, 1, 0, 1, 1, 1, 1, 2};
  const auto make = [&] {
    return Collider::create(std::make_shared<const Scene>(Scene::create(scene).value()), Doubles(x), {},
                            std::make_shared<Workers>(1))
        .value();
  };
  Collider collider = make();
  BodyPose turned{1, {{0, -1, 0, 0, 1, 0, 0, 0, 0, 0, 1, 0}}};
  Frame frame;
  frame.poses = {&turned, 1};
  ASSERT_TRUE(collider.trial(frame).ok());
  ASSERT_TRUE(collider.commit(0.5).ok());
  BodyPose left = collider.poses().at(0);
  Frame again;
  again.poses = {&left, 1};
  EXPECT_EQ(collider.step(again).value().statistics.counts.vertices_moved, 0U);
  ASSERT_TRUE(collider.trial(frame).ok());
  EXPECT_TRUE(collider.step(again).ok()) << "where it is, also after a trial";

  BodyPose other = left;
  other.pose.matrix[3] += 0.25;
  Frame elsewhere;
  elsewhere.poses = {&other, 1};
  EXPECT_THAT(collider.step(elsewhere).error().message, HasSubstr("is not rigid"));
  Collider restored = make();
  ASSERT_TRUE(restored.step(Frame{}).ok());
  ASSERT_TRUE(restored.place(again).ok());
  EXPECT_EQ(restored.positions(), collider.positions());
  ASSERT_TRUE(restored.place(elsewhere).ok()) << "without a motion";
  other.pose.matrix[0] = 2;
  EXPECT_THAT(restored.place(elsewhere).error().message, HasSubstr("lengthens something"));
}

// Two bodies are put next to each other by poses, far from where they were made, and rest: the first question
// knows of them by balls around them, and the next by their hierarchies, which are looser there. The pair had
// no front then, and the self-check said so.
TEST(Place, OfBodiesThatTouchNearly) {
  SceneDescription scene{15, {}, {{"", 0, 6, BodyKind::kRigid}, {"", 6, 6, BodyKind::kRigid}, {"", 12, 3}}};
  for (const int first : {0, 6}) {
    for (const auto& [a, b, c] : testing::octahedron())
      scene.faces.push_back({a + first, b + first, c + first});
  }
  scene.faces.push_back({12, 13, 14});
  constexpr double kFar = 4e4;
  std::vector<double> x;
  for (const int body : {0, 1}) {
    for (const double side : {1.0, -1.0}) {
      for (const int axis : {0, 1, 2})
        for (const int k : {0, 1, 2}) x.push_back((k == axis ? side : 0) + (k == 0 ? 3 * body : 0));
    }
  }
  x.insert(x.end(), {-1, 0.2, 0.1, 3, 0.2, 0.1, 0.5, 0.3, 3});
  for (int i = 0; i < 400; ++i) {
    Collider collider = Collider::create(std::make_shared<const Scene>(Scene::create(scene).value()),
                                         Doubles(x), {.separate_parts = false}, std::make_shared<Workers>(1))
                            .value();
    ASSERT_TRUE(collider.step(Frame{}).ok());
    std::vector<BodyPose> poses{{0, {}}, {1, {}}};
    for (BodyPose& pose : poses) pose.pose.matrix[3] = pose.pose.matrix[7] = pose.pose.matrix[11] = kFar;
    poses[1].pose.matrix[3] += 0.001 * i - 1.1;
    std::vector<double> triangle(x.end() - 9, x.end());
    for (double& c : triangle) c += kFar;
    const BodyPositions third{2, Doubles(triangle)};
    Frame frame;
    frame.poses = poses;
    frame.bodies = {&third, 1};
    ASSERT_TRUE(collider.place(frame).ok());
    for (int step = 0; step < 3; ++step) {
      ASSERT_TRUE(collider.step(Frame{}).ok());
      const Status sound = collider.self_check();
      ASSERT_TRUE(sound.ok()) << i << ", " << step << ": " << sound.error().message;
    }
  }
}

}  // namespace
}  // namespace warmfront

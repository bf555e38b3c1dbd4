// SPDX-License-Identifier: Apache-2.0
// Where everything is, told by a session in this process and by one behind a daemon: to the same bits.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "client/lib/any_session.h"
#include "engine/part_way.h"
#include "engine/screw.h"
#include "tests/support/poses.h"
#include "tests/support/scenes.h"
#include "tests/unit/server/local_daemon.h"

namespace warmfront::client {
namespace {

using testing::turned_about_x;

/// A static triangle, a tetrahedron that moves by poses, another one that does so along screws, a deformable
/// triangle, and a ground that turns.
SceneDescription scene() {
  SceneDescription scene;
  const auto body = [&](std::uint32_t vertices, BodyKind kind, const testing::Faces& faces) {
    for (const auto& [a, b, c] : faces) {
      const auto first = static_cast<std::int32_t>(scene.vertex_count);
      scene.faces.push_back({a + first, b + first, c + first});
    }
    scene.bodies.push_back({"", scene.vertex_count, vertices, kind});
    scene.vertex_count += vertices;
  };
  body(3, BodyKind::kStatic, {{0, 1, 2}});
  body(4, BodyKind::kRigid, testing::tetrahedron());
  body(4, BodyKind::kRigid, testing::tetrahedron());
  scene.bodies.back().screw = true;
  body(3, BodyKind::kDeformable, {{0, 1, 2}});
  body(0, BodyKind::kRigid, {});
  scene.bodies.back().half_space = HalfSpace{{0, 0, -9}, {0, 0, 1}};
  return scene;
}

template <class Number>
class AnySessionState : public ::testing::Test {
 protected:
  static constexpr bool kSingle = std::is_same_v<Number, float>;
  using Rows = std::span<const Number>;

  AnySessionState() {
    for (std::uint32_t i = 0; i < 3 * scene().vertex_count; ++i)
      start_.push_back(static_cast<Number>(std::sin(1.7 * i) + 0.3 * (i / 12)));
    both_.push_back(AnySession::create(scene(), Rows(start_), {}).value());
    both_.emplace_back(client_.create_session(scene(), Rows(start_), {}).value());
  }

  static Pose rounded(const Pose& pose) { return kSingle ? in_float32(pose) : pose; }
  /// Of body 1, body 2 and the ground, which is body 4.
  void expect_at(const std::array<Pose, 3>& poses) const {
    std::vector<double> positions(start_.begin(), start_.end());
    for (const std::uint32_t b : {1U, 2U}) {
      for (std::uint32_t v = 4 * b - 1; v < 4 * b + 3; ++v)
        std::ranges::copy(poses[b - 1].place(&positions[std::size_t{3} * v]),
                          positions.begin() + std::ptrdiff_t{3} * v);
    }
    constexpr std::array<std::uint32_t, 3> kBodies{1, 2, 4};
    for (const AnySession& session : both_) {
      EXPECT_EQ(session.positions().value(), positions) << session.is_remote();
      const std::vector<BodyPose> told = session.poses().value();
      ASSERT_EQ(told.size(), 3U);
      for (std::size_t i = 0; i < 3; ++i) {
        EXPECT_EQ(told[i].body, kBodies[i]);
        EXPECT_EQ(told[i].pose, poses[i]) << told[i].body << session.is_remote();
      }
    }
  }

  test::LocalDaemon daemon_;
  Client client_ = Client::connect(daemon_.address()).value();
  std::vector<Number> start_;
  std::vector<AnySession> both_;
};
using Numbers = ::testing::Types<double, float>;
TYPED_TEST_SUITE(AnySessionState, Numbers);

TYPED_TEST(AnySessionState, IsWhereTheLastStepOrCommitPutIt) {
  const auto rounded = TestFixture::rounded;
  this->expect_at({});
  const Pose ground = turned_about_x(0.1);
  const std::vector<BodyPose> first{{1, turned_about_x(0.3)}, {2, turned_about_x(0.5)}, {4, ground}};
  const std::vector<BodyPose> second{{1, turned_about_x(0.9)}, {2, turned_about_x(1.6)}};
  Frame there, further;
  there.poses = first;
  further.poses = second;
  QuestionOptions near;
  near.min_separation = 0.5;
  near.fields = ContactFields{.squared_distance = true};
  std::vector<ContactTable> met;
  for (AnySession& session : this->both_) {
    ASSERT_TRUE(session.step(there).ok());
    const Result<Answer> answer = session.trial(further, near);
    ASSERT_TRUE(answer.ok());
    met.push_back(answer.value().contacts);
  }
  EXPECT_EQ(met[0], met[1]);
  EXPECT_GT(met[0].size(), 0U);
  const std::array<Pose, 3> after{rounded(first[0].pose), rounded(first[1].pose), rounded(ground)};
  this->expect_at(after);  // a trial moves nothing
  for (AnySession& session : this->both_) ASSERT_TRUE(session.commit(0.25).ok());
  constexpr bool kSingle = TestFixture::kSingle;
  const std::array<Pose, 3> part_of_it{part_way(after[0], rounded(second[0].pose), 0.25, kSingle),
                                       screw_way(after[1], rounded(second[1].pose), 0.25, kSingle), after[2]};
  this->expect_at(part_of_it);
  // Positions of all are where a body rests from then on, but for the ground, which has none.
  for (AnySession& session : this->both_) {
    ASSERT_TRUE(session.place(Frame(typename TestFixture::Rows(this->start_))).ok());
  }
  this->expect_at({Pose(), Pose(), after[2]});
}

// What is given where it was has not moved, and X + f (Y - X) of zeros is a positive one.
TYPED_TEST(AnySessionState, KeepsTheSignOfAZeroThatDidNotMove) {
  using Rows = typename TestFixture::Rows;
  std::vector<TypeParam> start = this->start_;
  constexpr std::size_t kRests = 33, kMoves = 36;  // numbers of the deformable body's vertices 0 and 1
  start[kRests] = TypeParam(-0.0);
  std::vector<TypeParam> there = start;
  there[kMoves] += 1;
  BodyPose at{1, turned_about_x(0.3)};
  at.pose.matrix[1] = -0.0;
  Frame posed;
  posed.poses = {&at, 1};
  const std::array<BodyPositions, 1> moved{{{3, Rows(there).subspan(kRests, 9)}}};
  Frame both_move = posed;
  both_move.bodies = moved;
  for (AnySession& session : this->both_) {
    ASSERT_TRUE(session.place(Frame(Rows(start))).ok() && session.step(posed).ok());
    ASSERT_TRUE(session.trial(both_move).ok() && session.commit(0.5).ok());
    const std::vector<double> positions = session.positions().value();
    EXPECT_TRUE(std::signbit(positions[kRests])) << session.is_remote();
    EXPECT_EQ(positions[kMoves], static_cast<TypeParam>(start[kMoves] + 0.5));
    EXPECT_TRUE(std::signbit(session.poses().value()[0].pose.matrix[1])) << session.is_remote();
  }
}

TYPED_TEST(AnySessionState, WhatStaysKeepsItsBitsWhenAllAreGiven) {
  using Rows = typename TestFixture::Rows;
  BodyPose at{1, turned_about_x(0.3)};
  Frame posed;
  posed.poses = {&at, 1};
  for (AnySession& session : this->both_) {
    std::vector<TypeParam> now = this->start_;
    now[0] = 0;  // of the static one
    ASSERT_TRUE(session.place(Frame(Rows(now))).ok() && session.step(posed).ok());
    ASSERT_TRUE(session.change_body(1, {"", 0, 4, BodyKind::kRemoved}).ok());
    std::vector<double> where = session.positions().value();
    now[0] = TypeParam(-0.0);
    std::fill_n(now.begin() + 9, 12, TypeParam(7));  // of the removed one
    now[33] = 8;                                     // of the deformable one
    where[33] = 8;
    ASSERT_TRUE(session.step(Rows(now)).ok());
    EXPECT_EQ(session.positions().value(), where) << session.is_remote();
    EXPECT_FALSE(std::signbit(session.positions().value()[0])) << session.is_remote();
    now[33] = 9;
    ASSERT_TRUE(session.trial(Frame(Rows(now))).ok() && session.commit(0.5).ok());
    where[33] = 8.5;
    EXPECT_EQ(session.positions().value(), where) << session.is_remote();
    EXPECT_EQ(session.poses().value().size(), 2U);
  }
  EXPECT_EQ(this->both_[0].positions().value(), this->both_[1].positions().value());
}

TYPED_TEST(AnySessionState, WhatIsRemovedIsNotChangedThoughItWasAtAPose) {
  BodyPose at{1, turned_about_x(0.3)};
  Frame posed;
  posed.poses = {&at, 1};
  for (AnySession& session : this->both_) {
    ASSERT_TRUE(session.step(posed).ok());
    ASSERT_TRUE(session.change_body(1, {"", 0, 4, BodyKind::kRemoved}).ok());
    for (const BodyKind kind : {BodyKind::kDeformable, BodyKind::kStatic, BodyKind::kRigid})
      EXPECT_EQ(session.change_body(1, {"", 0, 4, kind}).error().code, ErrorCode::kInvalidArgument)
          << session.is_remote();
  }
}

TYPED_TEST(AnySessionState, ACommitOfNoFractionIsThatWithoutATrialToo) {
  for (AnySession& session : this->both_) {
    const auto refused = session.commit(std::nan(""));
    ASSERT_FALSE(refused.ok());
    EXPECT_EQ(refused.error().code, ErrorCode::kInvalidArgument) << session.is_remote();
    EXPECT_EQ(refused.error().message, "frame 1: fraction: nan is not in [0, 1]");
    EXPECT_EQ(session.commit(1.0000001).error().message, "frame 1: fraction: 1.0000001 is not in [0, 1]");
    EXPECT_EQ(session.commit(0.5).error().code, ErrorCode::kFailedPrecondition);
  }
}

TYPED_TEST(AnySessionState, OfAnotherTypeIsRefused) {
  using Other = std::conditional_t<TestFixture::kSingle, double, float>;
  const std::vector<Other> other(12, Other{1});
  const std::span<const Other> rows(other);
  for (AnySession& session : this->both_) {
    BodyAddition body;
    body.faces = testing::tetrahedron();
    body.body.vertex_count = 4;
    for (const Status& status :
         {Status(session.add_body(body, rows).error()), session.replace_body(1, body, rows)}) {
      ASSERT_FALSE(status.ok()) << session.is_remote();
      EXPECT_EQ(status.error().message, std::string("positions: the session was created with ") +
                                            (TestFixture::kSingle ? "float32" : "float64") +
                                            " positions; give every frame the same kind");
    }
  }
}

TYPED_TEST(AnySessionState, IsNotToldWhileAFrameIsOnItsWay) {
  for (AnySession& session : this->both_) {
    Pending<Answer> asked = session.step_async(Frame(typename TestFixture::Rows(this->start_)));
    for (const auto& error : {session.positions().error(), session.poses().error()}) {
      EXPECT_EQ(error.code, ErrorCode::kFailedPrecondition);
      EXPECT_EQ(error.message, "frames are unanswered; take their answers first");
    }
    ASSERT_TRUE(asked.get().ok());
    EXPECT_TRUE(session.positions().ok() && session.poses().ok());
  }
}

}  // namespace
}  // namespace warmfront::client

// SPDX-License-Identifier: Apache-2.0
// Trials and commits through the client library: the bits of a collider in this process, and one answer to
// each call, also where another daemon serves the session by then.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <limits>
#include <thread>
#include <type_traits>

#include "client/lib/client.h"
#include "tests/unit/server/answer_hash.h"
#include "tests/unit/server/local_daemon.h"
#include "tests/unit/server/moving_grids.h"
#include "tests/unit/server/switchboard.h"

namespace warmfront::test {
namespace {

using client::Answer;
using client::Client;
using client::Session;
using ::testing::HasSubstr;

std::uint64_t hash_of_step(const Scene& scene, const StepResult& step) {
  ContactHash hash;
  hash.add_step(scene, step.contacts);
  return hash.value();
}

/// A session of Real's kind, and beside it a collider that is asked the same.
template <class Real>
class ClientTrials : public ::testing::Test {
 protected:
  static constexpr bool kSingle = std::is_same_v<Real, float>;
  using Rows = std::vector<Real>;
  using View = std::span<const Real>;

  ClientTrials() {
    const std::uint32_t half = grids_.vertex_count() / 2;
    SceneDescription scene = grids_.scene();
    scene.bodies = {{"", 0, half}, {"", half, half, BodyKind::kRigid}};
    const Rows start = at(0);
    auto session = client_.create_session(scene, View(start));
    EXPECT_TRUE(session.ok()) << session.error().message;
    session_.emplace(std::move(session).value());
    collider_.emplace(Collider::create(std::make_shared<const Scene>(Scene::create(scene).value()),
                                       View(start), {}, std::make_shared<Workers>(1))
                          .value());
  }

  Rows at(std::uint64_t frame) const {
    const std::vector<double> values = grids_.positions(frame);
    return Rows(values.begin(), values.end());
  }
  void expect_same(const Result<Answer>& answer, const StepResult& expected) {
    ASSERT_TRUE(answer.ok()) << answer.error().message;
    EXPECT_EQ(hash_of(answer.value()), hash_of_step(collider_->scene(), expected));
    EXPECT_EQ(answer.value().earliest_toi, expected.earliest_toi);
    EXPECT_FALSE(answer.value().commit.has_value());
    contacts_ += answer.value().contacts.size();
  }
  static void expect_same(const Result<CommitResult>& commit, const CommitResult& expected) {
    ASSERT_TRUE(commit.ok()) << commit.error().message;
    EXPECT_EQ(commit.value().fraction, expected.fraction);
    EXPECT_EQ(commit.value().vf, expected.vf);
    EXPECT_EQ(commit.value().ee, expected.ee);
    EXPECT_EQ(commit.value().possible, expected.possible);
    EXPECT_EQ(commit.value().earliest_toi, expected.earliest_toi);
  }
  static constexpr Rounding kRounding = kSingle ? Rounding::kFloat32 : Rounding::kFloat64;
  CommitResult commit_here(double fraction) { return collider_->commit(fraction, kRounding).value(); }
  MaxStep max_step_here(View to) { return collider_->max_step(to, false, {}, nullptr, kRounding).value(); }
  /// The rigid grid by a pose, which goes on turning, and every other vertex of the other one.
  struct Moves {
    std::vector<std::uint32_t> vertices;
    Rows rows;
    BodyPose pose;
    Frame frame;
  };
  void make_moves(std::uint64_t k, Moves& moves) const {
    moves = {};
    const Rows to = at(k);
    for (std::uint32_t v = 0; v < grids_.vertex_count() / 2; v += 2) {
      moves.vertices.push_back(v);
      moves.rows.insert(moves.rows.end(), to.begin() + 3 * v, to.begin() + 3 * (v + 1));
    }
    const double angle = 0.03 * static_cast<double>(k);
    moves.pose = {1,
                  {{std::cos(angle), -std::sin(angle), 0, 0.1, std::sin(angle), std::cos(angle), 0, 0, 0, 0,
                    1, k % 2 == 0 ? 0.1 : -0.9}}};
    if (kSingle) moves.pose.pose = in_float32(moves.pose.pose);
    moves.frame.vertices = moves.vertices;
    moves.frame.vertex_positions = View(moves.rows);
    moves.frame.poses = std::span(&moves.pose, 1);
  }

  const MovingGrids grids_{6};
  LocalDaemon a_, b_;
  Switchboard board_{a_.address()};
  Client client_ = Client::connect(board_.address()).value();
  std::optional<Session> session_;
  std::optional<Collider> collider_;
  std::size_t contacts_ = 0;
};

using Kinds = ::testing::Types<float, double>;
TYPED_TEST_SUITE(ClientTrials, Kinds);

// After each commit the session continues at the other daemon, which gets only what the client
// keeps.
TYPED_TEST(ClientTrials, GoOnElsewhereFromWhatWasCommitted) {
  typename TestFixture::Moves moves;
  std::uint64_t k = 0;
  for (const double fraction : {0.4, 1.0, 0.7, 0.0, 0.25, 0.9, 0.5}) {
    ++k;
    // In turn: what moved, and all positions, of a grid that is at a pose then.
    const auto whole = this->at(k);
    Frame frame(typename TestFixture::View(whole.data(), whole.size()));
    this->make_moves(k, moves);
    if (k % 3 != 0) frame = moves.frame;
    this->expect_same(this->session_->trial(frame), this->collider_->trial(frame).value());
    this->expect_same(this->session_->commit(fraction), this->commit_here(fraction));
    this->board_.lead_to(k % 2 == 0 ? this->a_.address() : this->b_.address());
  }
  const auto last = this->at(8);
  this->expect_same(this->session_->step(typename TestFixture::View(last)),
                    this->collider_->step(typename TestFixture::View(last)).value());
  EXPECT_GT(this->contacts_, 100u);
  EXPECT_GE(this->session_->resumes(), 7u);
}

// Between a trial's answer and its commit the daemon is lost: the other one gets the trial again.
TYPED_TEST(ClientTrials, ACommitFollowsItsTrialToAnotherDaemon) {
  for (std::uint64_t k = 1; k <= 6; ++k) {
    const auto other = this->at(k + 1), to = this->at(k);
    using View = typename TestFixture::View;
    this->expect_same(this->session_->trial(View(other)), this->collider_->trial(View(other)).value());
    this->expect_same(this->session_->trial(View(to)), this->collider_->trial(View(to)).value());
    this->board_.lead_to(k % 2 == 0 ? this->a_.address() : this->b_.address());
    this->expect_same(this->session_->commit(0.8), this->commit_here(0.8));
    const auto stepped = this->session_->max_step(View(other));
    const MaxStep expected = this->max_step_here(View(other));
    ASSERT_TRUE(stepped.ok()) << stepped.error().message;
    EXPECT_EQ(stepped.value().fraction, expected.fraction);
    EXPECT_EQ(stepped.value().overlaps_at_start, expected.overlaps_at_start);
  }
  EXPECT_EQ(this->session_->resumes(), 6u);
}

// All of it in flight, and the answers lost: carried out once, answered once and in order.
TYPED_TEST(ClientTrials, WhatWasInFlightIsAnsweredOnce) {
  using View = typename TestFixture::View;
  Session& session = *this->session_;
  for (int lose = 0; lose < 4; ++lose) {
    const auto one = this->at(2 * lose + 1), two = this->at(2 * lose + 2);
    const std::uint64_t next = 2 * lose + 1;
    if (lose > 0) this->board_.lose_answers();
    EXPECT_EQ(session.submit(View(two), {.kind = QuestionKind::kTrial}).value(), next);
    EXPECT_EQ(session.submit(View(one), {.kind = QuestionKind::kTrial}).value(), next);
    EXPECT_EQ(session.submit_commit(0.9).value(), next);
    EXPECT_EQ(session.submit(View(two)).value(), next + 1);
    EXPECT_EQ(session.submit(View(one)).error().code, ErrorCode::kFailedPrecondition) << "the window";
    if (lose > 0) {
      std::this_thread::sleep_for(std::chrono::milliseconds(20));  // perhaps it is carried out, perhaps not
      this->board_.lead_to(lose == 2 ? this->b_.address() : this->a_.address());
    }
    this->expect_same(session.next_answer(), this->collider_->trial(View(two)).value());
    this->expect_same(session.next_answer(), this->collider_->trial(View(one)).value());
    const Result<Answer> committed = session.next_answer();
    ASSERT_TRUE(committed.ok()) << committed.error().message;
    EXPECT_EQ(committed.value().frame, next);
    ASSERT_TRUE(committed.value().commit.has_value());
    this->expect_same(Result<CommitResult>(*committed.value().commit), this->commit_here(0.9));
    this->expect_same(session.next_answer(), this->collider_->step(View(two)).value());
  }
}

// The commit alone is in flight; the daemon has carried it out, and answers it from memory.
TYPED_TEST(ClientTrials, ACommitWhoseAnswerIsLostIsCarriedOutOnce) {
  using View = typename TestFixture::View;
  const auto one = this->at(1), two = this->at(2);
  this->expect_same(this->session_->trial(View(one)), this->collider_->trial(View(one)).value());
  this->board_.lose_answers();
  ASSERT_TRUE(this->session_->submit_commit(0.5).ok());
  Client direct = Client::connect(this->a_.address()).value();
  for (int i = 0; i < 3000 && direct.get_session(this->session_->id()).value().last_frame == 0; ++i)
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  this->board_.lead_to(this->a_.address());
  const Result<Answer> committed = this->session_->next_answer();
  ASSERT_TRUE(committed.ok()) << committed.error().message;
  this->expect_same(Result<CommitResult>(committed.value().commit.value()), this->commit_here(0.5));
  EXPECT_EQ(direct.get_session(this->session_->id()).value().steps, 1u) << "it is the same copy";
  this->expect_same(this->session_->step(View(two)), this->collider_->step(View(two)).value());
}

TYPED_TEST(ClientTrials, WhatIsRefusedLeavesTheSessionWhereItIs) {
  using View = typename TestFixture::View;
  Session& session = *this->session_;
  const auto one = this->at(1), two = this->at(2);
  EXPECT_EQ(session.commit().error().code, ErrorCode::kFailedPrecondition) << "of no trial";
  this->expect_same(session.trial(View(one)), this->collider_->trial(View(one)).value());
  auto bad = two;
  bad[7] = std::numeric_limits<TypeParam>::quiet_NaN();
  EXPECT_EQ(session.trial(View(bad)).error().code, ErrorCode::kInvalidArgument);
  EXPECT_EQ(session.commit().error().code, ErrorCode::kFailedPrecondition) << "a later one failed";
  // In flight: the outcome is known only afterwards.
  EXPECT_EQ(session.submit(View(bad), {.kind = QuestionKind::kTrial}).value(), 1u);
  EXPECT_EQ(session.submit_commit().value(), 1u);
  EXPECT_EQ(session.next_answer().error().code, ErrorCode::kInvalidArgument);
  EXPECT_EQ(session.next_answer().error().code, ErrorCode::kFailedPrecondition);
  const auto refused = session.trial(View(one), {.tolerance = 7.0});
  EXPECT_EQ(refused.error().code, ErrorCode::kInvalidArgument);
  EXPECT_THAT(refused.error().message, HasSubstr("question.tolerance"));
  this->expect_same(session.trial(View(one)), this->collider_->trial(View(one)).value());
  EXPECT_EQ(session.commit(1.5).error().code, ErrorCode::kInvalidArgument);
  EXPECT_EQ(session.resumes(), 0u);
  this->expect_same(session.commit(1), this->commit_here(1));
  const QuestionOptions counted{.report = Report::kCount};
  const auto step = session.step(View(two), counted);
  ASSERT_TRUE(step.ok());
  EXPECT_EQ(step.value().contacts.size(), 0u);
  EXPECT_EQ(step.value().vf, this->collider_->step(View(two), nullptr, {}, counted).value().vf);
  EXPECT_GT(step.value().vf, 0u);
}

}  // namespace
}  // namespace warmfront::test

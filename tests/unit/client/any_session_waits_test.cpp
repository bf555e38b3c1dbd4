// SPDX-License-Identifier: Apache-2.0
// Questions asked asynchronously, or with a time limit, in this process and behind a daemon.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <limits>
#include <optional>
#include <thread>
#include <vector>

#include "client/lib/any_session.h"
#include "tests/support/hostile_scenes.h"
#include "tests/unit/server/answer_hash.h"
#include "tests/unit/server/local_daemon.h"
#include "tests/unit/server/moving_grids.h"

namespace warmfront::client {
namespace {

using std::chrono::milliseconds;
using ::testing::HasSubstr;
using Doubles = std::span<const double>;

constexpr const char* kPlaces[] = {"in this process", "behind a daemon"};

/// What a question without rows took.
constexpr QuestionOptions kCount{.report = Report::kCount};

class AnySessionWaitsTest : public ::testing::TestWithParam<const char*> {
 protected:
  AnySession open(SceneDescription scene, const std::vector<double>& start) {
    if (GetParam() == kPlaces[0]) return AnySession::create(scene, Doubles(start)).value();
    return client_.create_session(scene, Doubles(start)).value();
  }
  AnySession open() { return open(grids_.scene(), at(0)); }
  /// A session of a flat sheet, which it takes hours to test on its way to one point.
  AnySession open_endless() { return open(sheet_.description, sheet_.positions); }
  std::vector<double> at(std::uint64_t frame) const { return grids_.positions(frame); }

  const test::MovingGrids grids_{6};
  const testing::HostileScene sheet_ = testing::flat_grid(150);
  const std::vector<double> point_ = std::vector<double>(sheet_.positions.size());
  test::LocalDaemon daemon_;
  Client client_ = Client::connect(daemon_.address()).value();
};

INSTANTIATE_TEST_SUITE_P(Anywhere, AnySessionWaitsTest, ::testing::ValuesIn(kPlaces), [](const auto& place) {
  return place.param == kPlaces[0] ? "InThisProcess" : "BehindADaemon";
});

void expect_error(const Status& failed, ErrorCode code, const std::string& what) {
  ASSERT_FALSE(failed.ok());
  EXPECT_EQ(failed.error().code, code) << failed.error().message;
  EXPECT_THAT(failed.error().message, HasSubstr(what));
}
template <class T>
void expect_error(const Result<T>& failed, ErrorCode code, const std::string& what) {
  expect_error(failed ? Status{} : Status(failed.error()), code, what);
}

// Whether a step fails with one before it depends on what was waited for, and not on how fast that one
// failed.
TEST_P(AnySessionWaitsTest, WhatIsAskedBeforeAFailureIsKnownFailsToo) {
  AnySession session = open();
  std::vector<double> bad = at(1);
  bad[4] = std::numeric_limits<double>::infinity();
  const std::vector<double> there = at(1);
  Pending<Answer> near = session.proximity_async(0.3);
  Pending<Answer> failing = session.step_async(Frame{Doubles(bad)});
  EXPECT_TRUE(near.get().ok());
  std::this_thread::sleep_for(std::chrono::milliseconds(20));  // it may have failed by now, or not
  Pending<Answer> later = session.step_async(Frame{Doubles(there)});
  expect_error(failing.get(), ErrorCode::kInvalidArgument, "positions[1].y");
  expect_error(later.get(), ErrorCode::kFailedPrecondition, "");
  const Result<Answer> again = session.step(Frame{Doubles(there)});
  ASSERT_TRUE(again.ok()) << again.error().message;
  EXPECT_EQ(again.value().frame, 1U);
}

TEST_P(AnySessionWaitsTest, ARefusedCommitLeavesTheTrialAlsoWithAQuestionBehindIt) {
  AnySession session = open();
  const std::vector<double> there = at(1);
  ASSERT_TRUE(session.trial(Frame{Doubles(there)}).ok());
  Pending<CommitResult> too_far = session.commit_async(2);
  Pending<Answer> near = session.proximity_async(0.3);
  (void)near.get();  // whichever of the two is told of
  expect_error(too_far.get(), ErrorCode::kInvalidArgument, "fraction");
  EXPECT_TRUE(session.commit(1).ok());
  EXPECT_EQ(session.positions().value(), there);
}

// Many more than a window, taken from the last to the first: the answers of a session that waits for each.
TEST_P(AnySessionWaitsTest, WhatIsNotWaitedForHasTheSameAnswers) {
  AnySession waiting = open(), session = open();
  struct Asked {
    Pending<MaxStep> far;
    Pending<Answer> trial, end, near, room, tangled;
    Pending<CommitResult> commit;
    Pending<Answer> place, step;
  };
  std::vector<Asked> asked;
  for (std::uint64_t k = 1; k <= 5; ++k) {
    std::vector<double> there = at(k), further = at(k + 1);
    const Frame frame{Doubles(there)}, next{Doubles(further)};
    Pending<MaxStep> far = session.max_step_async(frame, true);
    Pending<Answer> trial = session.trial_async(frame);
    Pending<Answer> end = session.proximity_async(0.2, Where::kTrialEnd);
    Pending<Answer> near = session.proximity_async(0.3);
    Pending<Answer> room = session.vertex_distances_async(0.3);
    Pending<Answer> tangled = session.intersections_async();
    Pending<CommitResult> commit = session.commit_async(0.4);
    Pending<Answer> place = session.place_async(frame);
    asked.push_back({std::move(far), std::move(trial), std::move(end), std::move(near), std::move(room),
                     std::move(tangled), std::move(commit), std::move(place), session.step_async(next)});
    std::ranges::fill(there, 1e9);  // the caller's again
    std::ranges::fill(further, 1e9);
  }
  struct Expected {
    MaxStep far;
    Answer trial, end, near, room, tangled;
    CommitResult commit;
    Answer place, step;
  };
  std::vector<Expected> expected;
  for (std::uint64_t k = 1; k <= 5; ++k) {
    const std::vector<double> there = at(k), further = at(k + 1);
    const Frame frame{Doubles(there)}, next{Doubles(further)};
    Expected& one = expected.emplace_back();
    one.far = waiting.max_step(frame, true).value();
    one.trial = waiting.trial(frame).value();
    one.end = waiting.proximity(0.2, Where::kTrialEnd).value();
    one.near = waiting.proximity(0.3).value();
    one.room = waiting.vertex_distances(0.3).value();
    one.tangled = waiting.intersections().value();
    one.commit = waiting.commit(0.4).value();
    one.place = waiting.place(frame).value();
    one.step = waiting.step(next).value();
  }
  std::size_t rows = 0;
  const auto same = [&](Pending<Answer>& pending, const Answer& answer) {
    const Answer got = pending.get().value();
    EXPECT_EQ(got.frame, answer.frame);
    EXPECT_EQ(got.contacts, answer.contacts);
    EXPECT_EQ(got.vertex_distances, answer.vertex_distances);
    rows += got.contacts.size() + got.vertex_distances.size();
  };
  for (std::size_t k = asked.size(); k-- > 0;) {
    Asked& one = asked[k];
    same(one.step, expected[k].step);
    same(one.place, expected[k].place);
    const CommitResult commit = one.commit.get().value();
    EXPECT_EQ(commit.vf, expected[k].commit.vf);
    EXPECT_EQ(commit.ee, expected[k].commit.ee);
    EXPECT_EQ(commit.earliest_toi, expected[k].commit.earliest_toi);
    same(one.tangled, expected[k].tangled);
    same(one.room, expected[k].room);
    same(one.near, expected[k].near);
    same(one.end, expected[k].end);
    same(one.trial, expected[k].trial);
    EXPECT_EQ(one.far.get().value().fraction, expected[k].far.fraction);
  }
  EXPECT_GT(rows, 1000U);
}

TEST_P(AnySessionWaitsTest, AFrameOfWhatMovedIsTheCallersAgain) {
  AnySession session = open(), waiting = open();
  const std::vector<double> there = at(1);
  std::vector<std::uint32_t> vertices;
  std::vector<double> rows;
  for (std::uint32_t v = 1; v < grids_.vertex_count(); v += 2) vertices.push_back(v);
  for (const std::uint32_t v : vertices)
    rows.insert(rows.end(), there.begin() + 3 * v, there.begin() + 3 * (v + 1));
  Frame frame;
  frame.vertices = vertices;
  frame.vertex_positions = Doubles(rows);
  const Answer expected = waiting.trial(frame).value();
  Pending<Answer> few = session.trial_async(frame);
  std::ranges::fill(rows, 1e9);
  std::ranges::fill(vertices, 0);
  EXPECT_EQ(few.get().value().contacts, expected.contacts);
  EXPECT_GT(expected.contacts.size(), 0U);
}

TEST_P(AnySessionWaitsTest, ACancelledQuestionLeavesTheSessionAsItWas) {
  AnySession session = open_endless();
  const Frame endless{Doubles(point_)};
  // Cancelled before its turn, in its turn, by another thread while it is waited for, and by a flag.
  Pending<Answer> first = session.trial_async(endless, kCount), second = session.step_async(endless, kCount);
  EXPECT_FALSE(first.wait_for(milliseconds(20)));
  second.cancel();
  std::thread other([&] { first.cancel(); });
  expect_error(first.get(), ErrorCode::kCancelled, "frame 1: cancelled; it does not count");
  other.join();
  expect_error(second.get(), ErrorCode::kCancelled, "frame 1: cancelled");
  std::atomic<bool> stop{false};
  std::thread setter([&] {
    std::this_thread::sleep_for(milliseconds(500));  // in its turn, also on a slow machine
    stop = true;
  });
  expect_error(session.step(endless, kCount, {.cancelled = &stop}), ErrorCode::kCancelled, "frame 1");
  setter.join();
  expect_error(session.trial(endless, kCount, {.cancelled = &stop}), ErrorCode::kCancelled, "cancelled");
  Pending<CommitResult> no_trial = session.commit_async();
  expect_error(no_trial.get(), ErrorCode::kFailedPrecondition, "");
  const Answer any = session.intersections(Where::kBase, {.report = Report::kAny}).value();
  EXPECT_EQ(any.frame, 1U) << "none of them counted";
}

TEST_P(AnySessionWaitsTest, ATimeoutGivesAQuestionUpInItsTurn) {
  AnySession session = open_endless();
  const Frame endless{Doubles(point_)};
  expect_error(session.step(endless, kCount, {.timeout = milliseconds(20)}), ErrorCode::kDeadlineExceeded,
               "frame 1: no answer within 20 ms; it does not count");
  Pending<Answer> first = session.trial_async(endless, kCount, {.timeout = milliseconds(30)});
  Pending<Answer> then =
      session.intersections_async(Where::kBase, {.report = Report::kAny}, {.timeout = std::chrono::hours(1)});
  EXPECT_EQ(then.get().value().frame, 1U) << "its time begins in its turn";
  expect_error(first.get(), ErrorCode::kDeadlineExceeded, "no answer within 30 ms");
  for (const milliseconds none : {milliseconds(0), milliseconds(-5)})
    expect_error(session.trial(endless, kCount, {.timeout = none}), ErrorCode::kInvalidArgument,
                 "timeout: " + std::to_string(none.count()) + " ms; give a positive time");
  EXPECT_TRUE(
      session.intersections(Where::kBase, {.report = Report::kAny}, {.timeout = milliseconds::max()}).ok());
}

TEST_P(AnySessionWaitsTest, WhatWasAskedAfterAStepThatFailsFailsToo) {
  AnySession session = open_endless();
  std::vector<double> bad = point_;
  bad[7] = std::numeric_limits<double>::quiet_NaN();
  for (const bool is_bad : {true, false}) {
    Pending<Answer> step = session.step_async(Doubles(is_bad ? bad : point_), kCount);
    Pending<Answer> trial = session.trial_async(Doubles(sheet_.positions));
    Pending<CommitResult> commit = session.commit_async();
    Pending<Answer> tangled = session.intersections_async();
    if (!is_bad) step.cancel();
    expect_error(tangled.get(), ErrorCode::kFailedPrecondition, "frame 3");
    expect_error(commit.get(), ErrorCode::kFailedPrecondition, "frame 2");
    expect_error(trial.get(), ErrorCode::kFailedPrecondition, "frame 2");
    expect_error(step.get(), is_bad ? ErrorCode::kInvalidArgument : ErrorCode::kCancelled, "");
  }
  const Result<Answer> step = session.step(Doubles(sheet_.positions));
  ASSERT_TRUE(step.ok()) << step.error().message;
  EXPECT_EQ(step.value().frame, 1U);
}

TEST_P(AnySessionWaitsTest, TheTrialBeforeOneThatWasCancelledIsNoLongerCommitted) {
  AnySession session = open_endless();
  std::vector<double> lifted = sheet_.positions;
  for (std::size_t z = 2; z < lifted.size(); z += 3) lifted[z] += 1;
  ASSERT_TRUE(session.trial(Doubles(lifted)).ok());
  Pending<Answer> state = session.proximity_async(1e6, Where::kBase, kCount);
  state.cancel();
  expect_error(state.get(), ErrorCode::kCancelled, "");
  EXPECT_TRUE(session.intersections(Where::kTrialEnd).ok())
      << "it moves nothing, and the trial may still be committed";
  Pending<Answer> trial = session.trial_async(Doubles(point_), kCount);
  trial.cancel();
  Pending<Answer> end = session.intersections_async(Where::kTrialEnd);
  Pending<CommitResult> commit = session.commit_async();
  expect_error(trial.get(), ErrorCode::kCancelled, "");
  expect_error(end.get(), ErrorCode::kFailedPrecondition, "");
  expect_error(commit.get(), ErrorCode::kFailedPrecondition, "");
  ASSERT_TRUE(session.trial(Doubles(lifted)).ok());
  const std::atomic<bool> stop{true};
  expect_error(session.commit(0.5, {.cancelled = &stop}), ErrorCode::kCancelled, "");
  EXPECT_TRUE(session.commit(0.5).ok()) << "of the trial, which may still be committed";
  EXPECT_EQ(session.intersections().value().frame, 2U);
}

TEST_P(AnySessionWaitsTest, AnAnswerIsTakenOnce) {
  AnySession session = open();
  const std::vector<double> one = at(1);
  Pending<Answer> trial = session.trial_async(Frame{Doubles(one)});
  while (!trial.wait_for(milliseconds(0))) std::this_thread::yield();
  EXPECT_TRUE(trial.wait_for(milliseconds::max()));
  trial.cancel();
  EXPECT_TRUE(trial.get().ok()) << "the answer was there before";
  expect_error(trial.get(), ErrorCode::kFailedPrecondition, "taken before");
  static_cast<void>(session.step_async(Frame{Doubles(one)}));
  EXPECT_EQ(session.intersections().value().frame, 2U) << "a step counts even if its Pending was destroyed";
}

TEST_P(AnySessionWaitsTest, TheSceneChangesWhenNothingIsOnItsWay) {
  AnySession session = open();
  Pending<Answer> near = session.proximity_async(0.9);
  if (!near.wait_for(milliseconds(0)))
    expect_error(session.change_filters({.within_edges = 1}), ErrorCode::kFailedPrecondition, "unanswered");
  const std::size_t before = near.get().value().contacts.size();
  ASSERT_TRUE(session.change_filters({.within_edges = 2}).ok());
  EXPECT_LT(session.proximity(0.9).value().contacts.size(), before);
  ASSERT_TRUE(session.change_filters({}).ok());
  ASSERT_TRUE(session.change_options({.report = Report::kCount}).ok());
  EXPECT_EQ(session.proximity(0.9).value().contacts.size(), 0U);
  expect_error(session.change_options({.leaf_size = 2}), ErrorCode::kInvalidArgument, "leaf_size: is fixed");
  expect_error(session.change_excluded_pairs({{0, 99}}), ErrorCode::kInvalidArgument, "body 99 is not in");
  EXPECT_GT(session.proximity(0.9).value().vf, 0U);
}

TEST_P(AnySessionWaitsTest, ASessionEndsWithWhatItWasAsked) {
  std::optional<Pending<Answer>> first, second, untaken;
  {
    AnySession session = open_endless();
    const Frame endless{Doubles(point_)};
    untaken.emplace(session.intersections_async(Where::kBase, {.report = Report::kAny}));
    ASSERT_TRUE(untaken->wait_for(std::chrono::minutes(10)));
    first.emplace(session.trial_async(endless, kCount));
    second.emplace(session.step_async(endless, kCount));
    AnySession moved = std::move(session);
    EXPECT_FALSE(first->wait_for(milliseconds(10)));
  }
  expect_error(first->get(), ErrorCode::kFailedPrecondition, "closed");
  expect_error(second->get(), ErrorCode::kFailedPrecondition, "closed");
  EXPECT_TRUE(untaken->get().ok());
}

}  // namespace
}  // namespace warmfront::client

// SPDX-License-Identifier: Apache-2.0
// Questions of a daemon that are given up, or not waited for, while the daemon, or its answers, are lost: one
// answer to each, and none of what was given up counts, whatever the daemon did.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <limits>
#include <thread>

#include "client/lib/client.h"
#include "tests/support/hostile_scenes.h"
#include "tests/unit/server/answer_hash.h"
#include "tests/unit/server/local_daemon.h"
#include "tests/unit/server/moving_grids.h"
#include "tests/unit/server/switchboard.h"

namespace warmfront::test {
namespace {

using client::Answer;
using client::Client;
using client::Pending;
using client::Session;
using std::chrono::milliseconds;
using ::testing::HasSubstr;
using Doubles = std::span<const double>;

class ClientWaitsTest : public ::testing::Test {
 protected:
  static constexpr std::uint64_t kFrames = 12;

  std::vector<double> at(std::uint64_t frame) const { return grids_.positions(frame); }
  Session open() {
    const std::vector<double> start = at(0);
    return client_.create_session(grids_.scene(), Doubles(start)).value();
  }
  /// Waits until the daemon has answered this frame, whoever has heard of it.
  void await_in_daemon(const Session& session, std::uint64_t frame) {
    Client direct = Client::connect(daemon_.address()).value();
    while (direct.get_session(session.id()).value().last_frame < frame)
      std::this_thread::sleep_for(milliseconds(1));
  }
  void find_answers_again() { board_.lead_to(daemon_.address()); }
  /// A step of this frame is answered as in this process.
  void expect_step(Session& session, std::uint64_t frame) {
    const std::vector<double> there = at(frame);
    const Result<Answer> answer = session.step(Doubles(there));
    ASSERT_TRUE(answer.ok()) << answer.error().message;
    EXPECT_EQ(answer.value().frame, frame);
    EXPECT_EQ(hash_of(answer.value()), expected_[frame - 1]);
  }

  const MovingGrids grids_{6};
  const std::vector<std::uint64_t> expected_ = local_hashes(grids_, 0, kFrames);
  LocalDaemon daemon_;
  Switchboard board_{daemon_.address()};
  Client client_ = Client::connect(board_.address()).value();
};

template <class T>
void expect_error(const Result<T>& failed, ErrorCode code, const std::string& what) {
  ASSERT_FALSE(failed.ok());
  EXPECT_EQ(failed.error().code, code) << failed.error().message;
  EXPECT_THAT(failed.error().message, HasSubstr(what));
}

TEST_F(ClientWaitsTest, AStepThatTheDaemonCarriedOutAndThatIsCancelledDoesNotCount) {
  Session session = open();
  expect_step(session, 1);
  board_.lose_answers();
  const std::vector<double> elsewhere = at(7);
  Pending<Answer> step = session.step_async(Doubles(elsewhere));
  await_in_daemon(session, 2);
  EXPECT_FALSE(step.wait_for(milliseconds(5)));
  std::thread other([&] { step.cancel(); });
  expect_error(step.get(), ErrorCode::kCancelled, "frame 2: cancelled; it does not count");
  other.join();
  find_answers_again();
  const std::vector<double> there = at(2);
  EXPECT_EQ(session.trial(Doubles(there)).value().frame, 2U);
  expect_step(session, 2);
  expect_step(session, 3);
}

TEST_F(ClientWaitsTest, AStepThatWasGivenUpAndIsAskedAgainIsCarriedOutOnce) {
  Session session = open();
  for (std::uint64_t k = 1; k <= 3; ++k) {
    board_.lose_answers();
    const std::vector<double> there = at(k);
    Pending<Answer> step = session.step_async(Doubles(there), {}, {.timeout = milliseconds(k == 2 ? 1 : 30)});
    await_in_daemon(session, k);
    expect_error(step.get(), ErrorCode::kDeadlineExceeded, "does not count");
    find_answers_again();
    expect_step(session, k);
    EXPECT_EQ(client_.get_session(session.id()).value().steps, k) << "the answer that the daemon kept";
  }
  EXPECT_EQ(session.resumes(), 0U) << "no daemon was lost while it was waited for";
}

TEST_F(ClientWaitsTest, ACommitThatWasGivenUpMayBeMadeWithAnotherFraction) {
  Session session = open(), beside = open();
  const std::vector<double> there = at(1), next = at(2);
  const Answer trial = session.trial(Doubles(there)).value();
  ASSERT_EQ(hash_of(beside.trial(Doubles(there)).value()), hash_of(trial));
  board_.lose_answers();
  Pending<CommitResult> commit = session.commit_async(0.25);
  await_in_daemon(session, 1);
  commit.cancel();
  expect_error(commit.get(), ErrorCode::kCancelled, "frame 1");
  find_answers_again();
  const CommitResult taken = session.commit(0.75).value(), expected = beside.commit(0.75).value();
  EXPECT_EQ(taken.vf, expected.vf);
  EXPECT_EQ(taken.ee, expected.ee);
  EXPECT_EQ(hash_of(session.step(Doubles(next)).value()), hash_of(beside.step(Doubles(next)).value()));
}

TEST_F(ClientWaitsTest, ThoseBehindOneThatIsCancelledAreAnswered) {
  Session session = open(), beside = open();
  const std::vector<double> first = at(1), second = at(2);
  const std::uint64_t expected = hash_of(beside.trial(Doubles(second)).value());
  board_.lose_answers();
  Pending<Answer> before = session.trial_async(Doubles(first));
  Pending<Answer> behind = session.trial_async(Doubles(second));
  Pending<CommitResult> commit = session.commit_async(0.5);
  before.cancel();
  expect_error(before.get(), ErrorCode::kCancelled, "frame 1");
  find_answers_again();
  EXPECT_EQ(hash_of(behind.get().value()), expected);
  EXPECT_EQ(commit.get().value().ee, beside.commit(0.5).value().ee);
}

TEST_F(ClientWaitsTest, TheDaemonStopsWhatIsCancelled) {
  const testing::HostileScene sheet = testing::flat_grid(150);
  Session session = client_.create_session(sheet.description, Doubles(sheet.positions)).value();
  const std::vector<double> point(sheet.positions.size());  // it takes hours to test the way there
  std::atomic<bool> stop{false};
  std::thread other([&] {
    std::this_thread::sleep_for(milliseconds(20));
    stop = true;
  });
  expect_error(session.step(Doubles(point), {.report = Report::kCount}, {.cancelled = &stop}),
               ErrorCode::kCancelled, "frame 1");
  other.join();
  const Result<Answer> next = session.step(Doubles(sheet.positions));  // on the same thread of the session
  ASSERT_TRUE(next.ok()) << next.error().message;
  EXPECT_EQ(next.value().frame, 1U);
  EXPECT_EQ(session.resumes(), 0U);
}

TEST_F(ClientWaitsTest, NobodyIsWaitedForLongerThanAllowedWhileThereIsNoDaemon) {
  std::atomic<int> lost{0};
  client_ = Client::connect(board_.address(), {.call_timeout = std::chrono::hours(1),
                                               .resume_timeout = std::chrono::hours(1),
                                               .on_lost = [&](const Error&) { ++lost; }})
                .value();
  Session session = open();
  expect_step(session, 1);
  daemon_.stop();
  const std::vector<double> there = at(2);
  for (int time = 0; time < 8; ++time)
    expect_error(session.step(Doubles(there), {}, {.timeout = milliseconds(30)}),
                 ErrorCode::kDeadlineExceeded, "frame 2: no answer within 30 ms");
  std::atomic<bool> stop{false};
  std::thread other([&] {
    std::this_thread::sleep_for(milliseconds(20));
    stop = true;
  });
  expect_error(session.trial(Doubles(there), {}, {.cancelled = &stop}), ErrorCode::kCancelled, "frame 2");
  other.join();
  Pending<Answer> step = session.step_async(Doubles(there));
  EXPECT_FALSE(step.wait_for(milliseconds(30)));
  EXPECT_FALSE(step.wait_for(milliseconds(0)));
  daemon_.start();
  EXPECT_EQ(hash_of(step.get().value()), expected_[1]) << "however often it was given up before";
  expect_step(session, 3);
  EXPECT_GE(lost, 1);
}

TEST_F(ClientWaitsTest, WhatIsOnItsWayOutlivesTheDaemon) {
  Session session = open();
  std::vector<Pending<Answer>> steps;
  for (std::uint64_t k = 1; k <= kFrames; ++k) {
    const std::vector<double> there = at(k);
    steps.push_back(session.step_async(Doubles(there)));
    if (k % 4 == 0) daemon_.restart();
    if (k % 5 == 0) board_.lead_to(daemon_.address());
  }
  for (std::uint64_t k = kFrames; k > 0; --k)
    EXPECT_EQ(hash_of(steps[k - 1].get().value()), expected_[k - 1]);
}

// Given up at any moment, by a flag that may be set before, during and after the daemon's work.
TEST_F(ClientWaitsTest, GivenUpAtAnyMomentAStepCountsOrDoesNot) {
  Session session = open();
  int given_up = 0;
  for (std::uint64_t k = 1; k <= kFrames; ++k) {
    for (int late = 0;; ++late) {
      std::atomic<bool> stop{false};
      std::thread other([&] {
        std::this_thread::sleep_for(std::chrono::microseconds(50 * late));
        stop = true;
      });
      const std::vector<double> there = at(late % 2 == 0 ? k : k + 5);
      const Result<Answer> answer = late % 2 == 0 ? session.step(Doubles(there), {}, {.cancelled = &stop})
                                                  : session.trial(Doubles(there), {}, {.cancelled = &stop});
      other.join();
      if (!answer) {
        ASSERT_EQ(answer.error().code, ErrorCode::kCancelled) << answer.error().message;
        ++given_up;
      } else {
        EXPECT_EQ(answer.value().frame, k);
        if (late % 2 == 1) continue;
        EXPECT_EQ(hash_of(answer.value()), expected_[k - 1]);
        break;
      }
    }
  }
  RecordProperty("given_up", given_up);
}

TEST_F(ClientWaitsTest, PendingQuestionsAndSubmittedFramesShareTheOrder) {
  Session session = open();
  const std::vector<double> one = at(1), two = at(2), three = at(3);
  Pending<Answer> first = session.step_async(Doubles(one));
  ASSERT_EQ(session.submit(Doubles(two)).value(), 2U);
  expect_error(session.trial(Doubles(three)), ErrorCode::kFailedPrecondition, "unanswered");
  Pending<Answer> third = session.step_async(Doubles(three));
  expect_error(third.get(), ErrorCode::kFailedPrecondition, "unanswered");
  EXPECT_EQ(hash_of(session.next_answer().value()), expected_[1]);
  expect_error(session.next_answer(), ErrorCode::kFailedPrecondition, "no frame is unanswered");
  EXPECT_EQ(hash_of(first.get().value()), expected_[0]);
  expect_step(session, 3);
}

// A trial after a step that failed is out of order, too, and once its answer was taken the session goes on:
// it refused every further frame.
TEST_F(ClientWaitsTest, ATrialBehindAFrameThatFailedDoesNotBlockTheSession) {
  Session session = open();
  std::vector<double> bad = at(1);
  bad[3] = std::numeric_limits<double>::infinity();
  const std::vector<double> there = at(2);
  ASSERT_TRUE(session.submit(Doubles(bad)).ok());
  ASSERT_TRUE(session.submit(Doubles(there), {QuestionKind::kTrial}).ok());
  expect_error(session.next_answer(), ErrorCode::kInvalidArgument, "");
  expect_error(session.next_answer(), ErrorCode::kFailedPrecondition, "");
  expect_step(session, 1);
}

TEST_F(ClientWaitsTest, AClosedSessionHasNoAnswers) {
  Session session = open();
  board_.lose_answers();
  const std::vector<double> there = at(1);
  Pending<Answer> step = session.step_async(Doubles(there));
  find_answers_again();
  ASSERT_TRUE(session.close().ok());
  expect_error(step.get(), ErrorCode::kFailedPrecondition, "closed");
  expect_error(session.trial_async(Doubles(there)).get(), ErrorCode::kFailedPrecondition, "closed");
}

}  // namespace
}  // namespace warmfront::test

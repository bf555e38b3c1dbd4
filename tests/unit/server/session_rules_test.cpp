// SPDX-License-Identifier: Apache-2.0
// The parts of a session that need no network: ids, positions from bytes, frame numbers, the mailbox, the
// store.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstring>
#include <functional>
#include <future>
#include <latch>
#include <memory>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "server/session/frame_sequence.h"
#include "server/session/id.h"
#include "server/session/mailbox.h"
#include "server/session/position_buffer.h"
#include "server/session/step_cost.h"
#include "server/session/store.h"
#include "tests/support/observers.h"
#include "tests/unit/server/moving_grids.h"

namespace warmfront::server {
namespace {

using ::testing::HasSubstr;

constexpr const char* kId = "01234567-89ab-cdef-0123-456789abcdef";

TEST(SessionIdTest, TakesUuidsOnlyAndLowersThem) {
  EXPECT_EQ(SessionId::parse("01234567-89AB-cdef-0123-456789ABCDEF").value().text(), kId);
  for (const char* bad : {"", "1", "01234567-89ab-cdef-0123-456789abcdeg",
                          "0123456-789ab-cdef-0123-456789abcdef", "01234567-89ab-cdef-0123-456789abcdef0"})
    EXPECT_EQ(SessionId::parse(bad).fault().code, ErrorCode::kInvalidArgument) << bad;
}

TEST(PositionBufferTest, PiecesMayEndAnywhere) {
  const std::vector<float> values{1.5f, -2.0f, 3.25f, 0.0f, -0.0f, 1e30f};
  const std::string bytes(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(float));
  for (std::size_t piece = 1; piece <= bytes.size(); ++piece) {
    PositionBuffer buffer(Dtype::kFloat32, 2);
    for (std::size_t at = 0; at < bytes.size(); at += piece) {
      EXPECT_FALSE(buffer.complete().ok());
      ASSERT_TRUE(buffer.append(bytes.substr(at, piece)).ok());
    }
    ASSERT_TRUE(buffer.complete().ok());
    const auto view = std::get<std::span<const float>>(buffer.view());
    EXPECT_EQ(std::memcmp(view.data(), values.data(), bytes.size()), 0);
  }
}

TEST(PositionBufferTest, AnOverflowIsReportedWithTheLengths) {
  PositionBuffer buffer(Dtype::kFloat64, 1);
  ASSERT_TRUE(buffer.append(std::string(24, '\0')).ok());
  const Status over = buffer.append("x");
  ASSERT_FALSE(over.ok());
  EXPECT_THAT(over.error().message, HasSubstr("25 bytes"));
  EXPECT_THAT(over.error().message, HasSubstr("24 bytes are expected (1 vertices x 3 x float64)"));
  EXPECT_FALSE(buffer.complete().ok());
}

TEST(PositionBufferTest, EqualityIsBitwise) {
  PositionBuffer zeros(Dtype::kFloat32, 1), same(Dtype::kFloat32, 1), other(Dtype::kFloat32, 1);
  const float plus[3] = {0, 0, 0}, minus[3] = {0, -0.0f, 0};
  ASSERT_TRUE(zeros.append({reinterpret_cast<const char*>(plus), 12}).ok());
  ASSERT_TRUE(same.append({reinterpret_cast<const char*>(plus), 12}).ok());
  ASSERT_TRUE(other.append({reinterpret_cast<const char*>(minus), 12}).ok());
  EXPECT_TRUE(same == zeros);
  EXPECT_FALSE(other == zeros);
}

TEST(FrameSequenceTest, NextRepeatAndOutOfOrder) {
  using Verdict = FrameSequence::Verdict;
  FrameSequence frames(7);
  EXPECT_EQ(frames.classify(7), Verdict::kOutOfOrder) << "the first frame has no answer to repeat";
  EXPECT_EQ(frames.classify(8), Verdict::kNext);
  EXPECT_EQ(frames.classify(9), Verdict::kOutOfOrder);
  frames.advance();
  EXPECT_EQ(frames.classify(8), Verdict::kRepeat);
  EXPECT_EQ(frames.classify(7), Verdict::kOutOfOrder);
  EXPECT_EQ(frames.expected(), 9u);
  EXPECT_EQ(frames.steps(), 1u);
}

TEST(MailboxTest, JobsRunOneAtATimeInOrderAndAreBounded) {
  std::vector<int> order;
  std::atomic<int> running{0}, overlaps{0};
  {
    std::latch begun(1), go(1);  // outlive the runner, whose threads may still be about to leave them
    Runner runner(4);
    auto mailbox = std::make_shared<Mailbox>(runner, 3);
    mailbox->post_always([&] {
      begun.count_down();
      go.wait();
    });
    begun.wait();
    for (int i = 0; i < 3; ++i)
      ASSERT_TRUE(mailbox->post([&, i] {
        if (running.fetch_add(1) != 0) ++overlaps;
        order.push_back(i);
        running.fetch_sub(1);
      }));
    EXPECT_FALSE(mailbox->post([&] { order.push_back(99); })) << "the fourth waiting job is refused";
    go.count_down();
  }  // the runner finishes what was posted
  EXPECT_EQ(order, (std::vector<int>{0, 1, 2}));
  EXPECT_EQ(overlaps, 0);
}

TEST(MailboxTest, ABriefJobRunsOnTheCallersThreadUnlessOthersAreQueued) {
  std::vector<std::thread::id> threads;
  const auto note = [&] { threads.push_back(std::this_thread::get_id()); };
  const std::thread::id here = std::this_thread::get_id();
  {
    std::latch go(1), done(1);
    Runner runner(1, 1);
    auto mailbox = std::make_shared<Mailbox>(runner, 3);
    mailbox->foresee(Lane::kShort, 1.5);
    mailbox->run_or_post(note);
    ASSERT_EQ(threads.size(), 1u) << "it has run";
    EXPECT_EQ(threads.back(), here);
    // What a job posts to its own mailbox comes after it, and on another thread.
    mailbox->run_or_post([&] {
      note();
      mailbox->run_or_post([&] {
        go.wait();
        note();
        done.count_down();
      });
    });
    ASSERT_EQ(threads.size(), 2u);
    EXPECT_EQ(threads.back(), here);
    mailbox->run_or_post(note);
    EXPECT_EQ(threads.size(), 2u) << "another waits";
    go.count_down();
    done.wait();
  }
  ASSERT_EQ(threads.size(), 4u);
  EXPECT_NE(threads[2], here);
  EXPECT_NE(threads[3], here);
}

/// Two mailboxes on one thread. Steps note their names; none begins before all are posted.
class Turns {
 public:
  explicit Turns(std::ptrdiff_t jobs) : done_(jobs) {
    runner_.post([this] { go_.wait(); }, Lane::kShort);
  }
  void post(
      Mailbox& to, char name, std::function<void()> work = [] {}, Mailbox::Kind kind = Mailbox::Kind::kStep) {
    to.post_always(
        [this, name, work = std::move(work)] {
          work();
          order_ += name;
          done_.count_down();
        },
        kind);
  }
  std::string order() {
    go_.count_down();
    done_.wait();  // a runner that ends has every thread help
    return order_;
  }

 private:
  std::string order_;
  std::latch go_{1}, done_;
  Runner runner_{1};

 public:
  const std::shared_ptr<Mailbox> a = std::make_shared<Mailbox>(runner_, 3);
  const std::shared_ptr<Mailbox> b = std::make_shared<Mailbox>(runner_, 3);
};

/// The order of three jobs each, with these costs per job of A and B.
std::string turns_of(double ms_a, double ms_b) {
  Turns turns(6);
  turns.a->foresee(Lane::kShort, ms_a);
  turns.b->foresee(Lane::kShort, ms_b);
  for (int i = 0; i < 3; ++i) {
    turns.post(*turns.a, 'A');
    turns.post(*turns.b, 'B');
  }
  return turns.order();
}

TEST(MailboxTest, ATurnTakesSeveralBriefSteps) {
  EXPECT_EQ(turns_of(0.6, 0.6), "AAABBB");
  EXPECT_EQ(turns_of(0.9, 0.6), "AABBBA");
  EXPECT_EQ(turns_of(1.5, Mailbox::kUnforeseen), "ABABAB");
  EXPECT_EQ(turns_of(30, 0.9), "ABBABA");
}

TEST(MailboxTest, AJobThatInvalidatesPredictionsEndsItsTurn) {
  Turns turns(3);
  for (const auto& mailbox : {turns.a, turns.b}) mailbox->foresee(Lane::kShort, 0.1);
  turns.post(*turns.a, 'A', [&] { turns.a->foresee(Lane::kShort, Mailbox::kUnforeseen); });
  turns.post(*turns.a, 'a');
  turns.post(*turns.b, 'B');
  EXPECT_EQ(turns.order(), "ABa");
}

// Predictions cover steps only: a change of the scene may take long, on a guest's thread too.
TEST(MailboxTest, AJobThatIsNoStepHasATurnOfItsOwn) {
  Turns turns(5);
  for (const auto& mailbox : {turns.a, turns.b}) mailbox->foresee(Lane::kShort, 0.1);
  turns.post(*turns.a, 'A');
  turns.post(
      *turns.a, 'c', [] {}, Mailbox::Kind::kOther);
  turns.post(*turns.a, 'A');
  turns.post(*turns.b, 'B');
  turns.post(*turns.b, 'B');
  EXPECT_EQ(turns.order(), "ABBcA");
}

TEST(MailboxTest, StepsOfTheSmallestSceneDoNotKeepTheirTurnForLong) {
  Turns turns(1001);
  for (const auto& mailbox : {turns.a, turns.b}) mailbox->foresee(Lane::kShort, step_cost_ms(1, {}));
  for (int i = 0; i < 1000; ++i) turns.post(*turns.a, 'A');
  turns.post(*turns.b, 'B');
  EXPECT_LT(turns.order().find('B'), 50u);
}

TEST(MailboxTest, AMailboxMayBeDestroyedByItsLastJob) {
  Runner runner(1, 1);
  auto mailbox = std::make_shared<Mailbox>(runner, 3);
  const std::weak_ptr<Mailbox> weak = mailbox;
  mailbox->foresee(Lane::kShort, 1.5);
  Mailbox& last = *mailbox;
  last.run_or_post([held = std::move(mailbox)] {});
  EXPECT_TRUE(weak.expired());
}

bool run_here(Runner& runner, const std::function<void()>& work, Lane lane) {
  Runner::Tasks one;
  one.emplace_back([&] {
    work();
    return std::optional<Lane>();
  });
  return runner.run_here(one, lane);
}

TEST(RunnerTest, AGuestNeitherWaitsNorBlocksOthers) {
  std::latch begun(1), go(1), done(2);
  Runner runner(1, 1);
  int ran = 0;
  EXPECT_TRUE(run_here(
      runner,
      [&] {
        ++ran;
        EXPECT_EQ(runner.busy(), 1);
        EXPECT_FALSE(run_here(
            runner, [&] { ++ran; }, Lane::kShort))
            << "one guest at a time";
      },
      Lane::kShort));
  EXPECT_EQ(ran, 1);
  runner.post(
      [&] {
        begun.count_down();
        go.wait();
      },
      Lane::kShort);
  begun.wait();
  EXPECT_FALSE(runner.backlog());
  EXPECT_TRUE(run_here(
      runner, [&] { ++ran; }, Lane::kShort))
      << "a running job does not count as waiting";
  runner.post([&] { done.count_down(); }, Lane::kShort);
  EXPECT_FALSE(run_here(
      runner, [&] { ++ran; }, Lane::kShort))
      << "one waits in this lane";
  EXPECT_FALSE(runner.backlog());
  runner.post([&] { done.count_down(); }, Lane::kShort);
  EXPECT_TRUE(runner.backlog()) << "two wait for one thread";
  EXPECT_TRUE(run_here(
      runner, [&] { ++ran; }, Lane::kLong));
  go.count_down();
  done.wait();
  EXPECT_EQ(ran, 3);
  Runner none(1);
  EXPECT_FALSE(run_here(
      none, [&] { ++ran; }, Lane::kShort))
      << "no guests";
  static_assert(noexcept(runner.run_here(std::declval<Runner::Tasks&>(), Lane::kShort)),
                "gRPC swallows what is thrown on its threads: the session would hang");
}

TEST(RunnerTest, AShortTaskDoesNotWaitForLongOnesAndNothingIsLeftAtTheEnd) {
  std::atomic<int> ran{0};
  {
    std::latch begun(1), go(1), done(1);
    Runner runner(1);
    runner.post([&] {
      begun.count_down();
      go.wait();
      runner.post([&] { ++ran; }, Lane::kShort);
    });
    begun.wait();
    runner.post([&] { ++ran; });
    runner.post(
        [&] {
          EXPECT_EQ(runner.busy(), 2);
          done.count_down();
        },
        Lane::kShort);
    done.wait();
    EXPECT_EQ(ran, 0) << "the long lane is taken";
    go.count_down();
  }
  EXPECT_EQ(ran, 2);
}

TEST(RunnerTest, TheLeastWeightedTimeComesFirst) {
  const auto order_of = [](std::uint32_t weight_a, std::uint32_t weight_b) {
    const auto a = std::make_shared<Share>(weight_a), b = std::make_shared<Share>(weight_b);
    std::string order;
    std::latch go(1), done(13);
    // A clock of its own: each task takes 20 ms of it, however long the machine takes.
    std::atomic<int> now_ms{0};
    Runner runner(1, 0, std::nullopt, [&now_ms] {
      return std::chrono::steady_clock::time_point(std::chrono::milliseconds(now_ms.load()));
    });
    runner.post([&] {
      go.wait();
      done.count_down();
    });
    const auto post = [&](char name, const std::shared_ptr<Share>& share) {
      runner.post(
          [&, name] {
            order += name;
            now_ms += 20;
            done.count_down();
          },
          Lane::kLong, share);
    };
    for (int i = 0; i < 6; ++i) post('a', a);
    for (int i = 0; i < 6; ++i) post('b', b);
    go.count_down();
    done.wait();
    return order;
  };
  EXPECT_EQ(order_of(1, 1), "abababababab");
  EXPECT_EQ(order_of(3, 1), "abaaabaabbbb");
}

TEST(RunnerTest, AThreadReplacesOneThatBlocksOthers) {
  for (const Lane lane : {Lane::kShort, Lane::kLong}) {
    std::latch go(1), last(1);
    std::atomic<int> ended{0};
    Runner runner(1, 0, Runner::Overrun{{std::chrono::milliseconds(1), std::chrono::milliseconds(1)}, 2});
    const auto hog = [&] {
      go.wait();
      ++ended;
    };
    // Two that never end, then one that does.
    runner.post(hog, lane);
    runner.post(hog, lane);
    runner.post([&] { last.count_down(); }, lane);
    last.wait();
    EXPECT_EQ(ended, 0);
    go.count_down();
    while (ended < 2) std::this_thread::yield();
    // Afterwards the lane is back to one thread.
    for (int i = 0; i < 100; ++i) {
      std::latch done(1);
      runner.post([&] { done.count_down(); }, lane);
      done.wait();
    }
  }
}

TEST(RunnerTest, ReplacementThreadsAreBounded) {
  std::latch go(1), begun(3);
  std::atomic<bool> fourth{false};
  Runner runner(1, 0, Runner::Overrun{{std::chrono::milliseconds(1), std::chrono::milliseconds(1)}, 2});
  for (int i = 0; i < 3; ++i)
    runner.post([&] {
      begun.count_down();
      go.wait();
    });
  begun.wait();
  runner.post([&] { fourth = true; });
  std::this_thread::sleep_for(std::chrono::milliseconds(50));
  EXPECT_FALSE(fourth);
  go.count_down();
  while (!fourth) std::this_thread::yield();
}

TEST(StepCostTest, IsByWhatWasDone) {
  EXPECT_EQ(lane_of(step_cost_ms(4344, {})), Lane::kShort);
  StepCounts busy;
  busy.elementary_tests = 1'000'000;
  EXPECT_EQ(lane_of(step_cost_ms(4344, busy)), Lane::kLong);
  EXPECT_EQ(lane_of(step_cost_ms(1'000'000, {})), Lane::kLong);
  EXPECT_TRUE(is_brief(step_cost_ms(4344, {})));
  EXPECT_FALSE(is_brief(step_cost_ms(92'000, {})));
  EXPECT_FALSE(is_brief(Mailbox::kUnforeseen));
}

class StoreTest : public ::testing::Test {
 protected:
  std::shared_ptr<Session> make(const SessionId& id) {
    const test::MovingGrids grids(3);
    PositionBuffer positions(Dtype::kFloat64, grids.vertex_count());
    const std::vector<double> start = grids.positions(0);
    EXPECT_TRUE(positions.append({reinterpret_cast<const char*>(start.data()), start.size() * 8}).ok());
    return Session::create({id, grids.scene(), {}, Dtype::kFloat64, 0, {}}, positions,
                           {workers_, runner_, limits_, Account::open(budget_, 1 << 30, 0).value(),
                            [](Session&, const Fault&) {}})
        .value();
  }
  std::shared_ptr<Workers> workers_ = std::make_shared<Workers>(1);
  Budget budget_{1 << 30};
  Runner runner_{1};
  const Limits limits_;
  const SessionId id_ = SessionId::parse(kId).value();
};

TEST_F(StoreTest, APlaceIsTakenGivenBackAndFilled) {
  Store store(1);
  {
    const auto place = store.reserve(id_);
    ASSERT_TRUE(place.ok());
    EXPECT_EQ(store.reserve(id_).fault().code, ErrorCode::kAlreadyExists);
    EXPECT_EQ(store.reserve(SessionId::parse("11234567-89ab-cdef-0123-456789abcdef").value()).fault().code,
              ErrorCode::kResourceExhausted);
    EXPECT_EQ(store.find(id_).fault().code, ErrorCode::kNotFound) << "still being built";
  }
  EXPECT_EQ(store.size(), 0u);
  store.reserve(id_).value().fill(make(id_));
  EXPECT_TRUE(store.find(id_).ok());
  EXPECT_EQ(store.list().size(), 1u);
}

TEST_F(StoreTest, OnlyIdleSessionsWithoutAStreamExpire) {
  Store store(1);
  const std::shared_ptr<Session> session = make(id_);
  store.reserve(id_).value().fill(session);
  EXPECT_TRUE(store.remove_idle(std::chrono::hours(1)).empty());
  const auto attachment = session->attach(
      false, [](const Fault&) {}, [](const Outcome<Standing>&) {});
  ASSERT_TRUE(attachment.ok());
  EXPECT_TRUE(store.remove_idle(std::chrono::milliseconds(0)).empty());
  session->detach(attachment.value());
  EXPECT_EQ(store.remove_idle(std::chrono::milliseconds(0)).size(), 1u);
  EXPECT_EQ(store.size(), 0u);
}

// Its eviction and a frame of its own may cross: that frame is not carried out behind the back of the stream
// that took over, which was told where the session stands.
TEST_F(StoreTest, AFrameOfAStreamThatWasTakenOverIsRefused) {
  const std::shared_ptr<Session> session = make(id_);
  const auto attach = [&] {
    std::promise<std::uint64_t> frame;
    const auto attachment = session->attach(
        true, [](const Fault&) {},
        [&](const Outcome<Standing>& standing) { frame.set_value(standing.value().now.frame); });
    EXPECT_EQ(frame.get_future().get(), 0u);
    return attachment.value();
  };
  const std::vector<double> moved = test::MovingGrids(3).positions(1);
  const auto step = [&](std::optional<Attachment> from) {
    FrameBuffer positions(Dtype::kFloat64, *session->scene());
    EXPECT_TRUE(positions.append({reinterpret_cast<const char*>(moved.data()), moved.size() * 8}).ok());
    FramePass pass;
    pass.attachment = from;
    std::promise<Outcome<std::shared_ptr<const Answer>>> done;
    session->submit({1, FrameQuestion{std::move(positions)}, std::move(pass),
                     test::tell_frame([&](const FrameOutcome& outcome) { done.set_value(outcome); })},
                    Session::Admission::kAlways);
    return done.get_future().get();
  };
  const Attachment before = attach(), now = attach();
  const auto refused = step(before);
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.fault().code, ErrorCode::kAborted);
  EXPECT_EQ(refused.fault().reason, Reason::kSessionAttached);
  EXPECT_TRUE(step(now).ok());
  EXPECT_TRUE(step(std::nullopt).ok()) << "a call without a stream, of the same frame";
}

// A step that takes longer than the idle timeout is answered from a session that is there.
TEST_F(StoreTest, ASessionWithARequestInHandDoesNotExpire) {
  Store store(1);
  const std::shared_ptr<Session> session = make(id_);
  store.reserve(id_).value().fill(session);
  // The runner outlives the latches: no thread may still be leaving `go` when the test ends.
  std::latch begun(1), go(1), gone(2);
  std::promise<void> checked;
  runner_.post([&] {
    begun.count_down();
    go.wait();
    gone.count_down();
  });
  runner_.post(
      [&] {
        go.wait();
        gone.count_down();
      },
      Lane::kShort);
  begun.wait();
  session->check([&](const Outcome<std::string>& found) {
    EXPECT_TRUE(found.ok());
    checked.set_value();
  });
  const bool stayed = store.remove_idle(std::chrono::milliseconds(0)).empty();
  go.count_down();
  gone.wait();
  ASSERT_TRUE(stayed) << "its runner is busy with others";
  checked.get_future().wait();
  // The request is done a moment after it was answered.
  while (store.remove_idle(std::chrono::milliseconds(0)).empty()) std::this_thread::yield();
  EXPECT_EQ(store.size(), 0u);
}

TEST_F(StoreTest, ACancelledFrameIsNotRun) {
  const std::shared_ptr<Session> session = make(id_);
  const test::MovingGrids grids(3);
  const auto step = [&](bool given_up) {
    FrameBuffer positions(Dtype::kFloat64, *session->scene());
    const std::vector<double> values = grids.positions(1);
    EXPECT_TRUE(positions.append({reinterpret_cast<const char*>(values.data()), values.size() * 8}).ok());
    FramePass pass;
    pass.given_up = std::make_shared<std::atomic<bool>>(given_up);
    std::promise<Outcome<std::shared_ptr<const Answer>>> answer;
    session->submit({1, FrameQuestion{std::move(positions)}, std::move(pass),
                     test::tell_frame([&](const FrameOutcome& outcome) { answer.set_value(outcome); })},
                    Session::Admission::kBounded);
    return answer.get_future().get();
  };
  const auto given_up = step(true);
  ASSERT_FALSE(given_up.ok());
  EXPECT_EQ(given_up.fault().code, ErrorCode::kCancelled);
  EXPECT_EQ(session->snapshot().steps, 0u);
  EXPECT_TRUE(step(false).ok());
  EXPECT_EQ(session->snapshot().steps, 1u);
}

}  // namespace
}  // namespace warmfront::server

// SPDX-License-Identifier: Apache-2.0
// A session's queue and its threads: jobs one at a time and in order, lanes, turns, and who waits for whom.
#include "server/session/mailbox.h"

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

#include "server/session/step_cost.h"

namespace warmfront::server {
namespace {

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
    Runner runner(1, {1});
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
  Runner runner(1, {1});
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
  Runner runner(1, {1});
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
    Runner runner(1, {}, std::nullopt, [&now_ms] {
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
    Runner runner(1, {}, Runner::Overrun{{std::chrono::milliseconds(1), std::chrono::milliseconds(1)}, 2});
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
  Runner runner(1, {}, Runner::Overrun{{std::chrono::milliseconds(1), std::chrono::milliseconds(1)}, 2});
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

}  // namespace
}  // namespace warmfront::server

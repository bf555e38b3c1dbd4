// SPDX-License-Identifier: Apache-2.0
// Memory accounts and gates: what is charged is given back, whoever comes first, and limits refuse without
// changing anything.
#include "server/session/account.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <thread>
#include <vector>

#include "server/session/frame_pass.h"

namespace warmfront::server {
namespace {

using ::testing::HasSubstr;

TEST(AccountTest, TheReservationIsChargedUntilMoreIsHeld) {
  Budget budget(1000);
  {
    const auto account = Account::open(budget, 800, 300).value();
    EXPECT_EQ(budget.used(), 300u);
    Holding first(account, 200);
    EXPECT_EQ(budget.used(), 300u) << "within the reservation";
    Holding second(account, 250);
    EXPECT_EQ(budget.used(), 450u);
    EXPECT_EQ(account->held(), 450u);
    second.set(50);
    EXPECT_EQ(budget.used(), 300u);
    Holding moved = std::move(first);
    EXPECT_EQ(account->held(), 250u);
  }
  EXPECT_EQ(budget.used(), 0u);
}

TEST(AccountTest, RefusalsNameTheSettingAndChangeNothing) {
  Budget budget(1000);
  const auto large = Account::open(budget, 800, 801);
  ASSERT_FALSE(large.ok());
  EXPECT_STREQ(large.fault().limit, "max-session-bytes");
  EXPECT_FALSE(large.fault().retry_after) << "it will never fit";
  const auto first = Account::open(budget, 800, 600).value();
  const auto second = Account::open(budget, 800, 600);
  ASSERT_FALSE(second.ok());
  EXPECT_EQ(second.fault().code, ErrorCode::kResourceExhausted);
  EXPECT_STREQ(second.fault().limit, "max-total-bytes");
  EXPECT_TRUE(second.fault().retry_after);
  EXPECT_EQ(budget.used(), 600u);
}

TEST(AccountTest, OnlyWhoGrewBeyondItsReservationSuffersFromAFullDaemon) {
  Budget budget(1000);
  const auto modest = Account::open(budget, 2000, 400).value();
  const auto greedy = Account::open(budget, 2000, 400).value();
  const Holding small(modest, 400), large(greedy, 700);
  EXPECT_GT(budget.used(), budget.limit());
  EXPECT_FALSE(modest->refusal());
  ASSERT_TRUE(greedy->refusal());
  EXPECT_STREQ(greedy->refusal()->limit, "max-total-bytes");
  const Holding larger(greedy, 1400);
  EXPECT_STREQ(greedy->refusal()->limit, "max-session-bytes");
  EXPECT_THAT(greedy->refusal()->message, HasSubstr("2.1 KiB"));
}

TEST(AccountTest, APrincipalHasABudgetOfItsOwnWithinTheDaemons) {
  Budget budget(1000);
  PrincipalBudgets principals(500);
  const auto open = [&](const char* name, std::size_t reserved) {
    return Account::open(budget, 2000, reserved, principals.of(name));
  };
  auto alices = open("alice", 300).value();
  const auto refused = open("alice", 300);
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.fault().code, ErrorCode::kResourceExhausted);
  EXPECT_STREQ(refused.fault().limit, "max-principal-bytes");
  EXPECT_THAT(refused.fault().message, HasSubstr("this principal's sessions hold all"));
  EXPECT_TRUE(refused.fault().retry_after);
  EXPECT_EQ(budget.used(), 300u) << "what was refused is charged to nobody";
  const auto bobs = open("bob", 300).value();
  EXPECT_STREQ(open("carol", 450).fault().limit, "max-total-bytes");
  EXPECT_EQ(principals.of("carol")->used(), 0u);

  // One who grows beyond what is its own meets its limit, and nobody else does.
  Holding grown(alices, 600);
  ASSERT_TRUE(alices->refusal());
  EXPECT_STREQ(alices->refusal()->limit, "max-principal-bytes");
  EXPECT_FALSE(bobs->refusal());
  grown.set(0);
  EXPECT_FALSE(alices->refusal());
  grown = Holding();
  alices.reset();
  EXPECT_EQ(principals.of("alice")->used(), 0u);
  EXPECT_TRUE(open("alice", 500).ok());
}

TEST(AccountTest, ManyThreadsLeaveNothingBehind) {
  Budget budget(1 << 20);
  {
    const auto account = Account::open(budget, 1 << 20, 500).value();
    std::vector<std::thread> threads;
    for (std::size_t t = 1; t <= 4; ++t)
      threads.emplace_back([&account, t] {
        Holding holding(account);
        for (std::size_t i = 0; i < 20'000; ++i) holding.set(i * t % 700);
      });
    for (std::thread& thread : threads) thread.join();
    EXPECT_EQ(account->held(), 0u);
    EXPECT_EQ(budget.used(), 500u);
  }
  EXPECT_EQ(budget.used(), 0u);
}

TEST(GateTest, LetsInAsManyAsItSays) {
  Gate gate(2);
  Budget budget(1 << 20);
  const auto account = Account::open(budget, 1 << 20, 0).value();
  std::optional<FramePass> first = admit_frame(gate, account, 100);
  const FramePass second = admit_frame(gate, account, 10);
  EXPECT_FALSE(first->refused || second.refused);
  const FramePass third = admit_frame(gate, account, 10);
  ASSERT_TRUE(third.refused);
  EXPECT_STREQ(third.refused->limit, "max-frames-in-flight");
  EXPECT_EQ(gate.inside(), 2u);
  EXPECT_EQ(account->held(), 120u);
  first.reset();
  EXPECT_EQ(gate.inside(), 1u);
  EXPECT_TRUE(gate.enter());
}

TEST(EstimateTest, GrowsWithTheScene) {
  const Limits limits;
  EXPECT_GT(estimate_bytes(1000, 2000, 8, false, limits), estimate_bytes(1000, 2000, 4, false, limits));
  EXPECT_GT(estimate_bytes(0, 0, 4, false, limits), 0u);
  EXPECT_GT(estimate_bytes(16'000'000, 16'000'000, 8, false, limits), std::size_t{16} << 30);
}

TEST(EstimateTest, CountsTheColliderThatExplainRunsBeside) {
  const Limits limits;
  const std::size_t alone = estimate_bytes(100'000, 200'000, 8, false, limits);
  const std::size_t frames = (limits.window + 1) * 24 * 100'000;
  EXPECT_GT(estimate_bytes(100'000, 200'000, 8, true, limits), 2 * alone - frames - (1 << 20));
}

}  // namespace
}  // namespace warmfront::server

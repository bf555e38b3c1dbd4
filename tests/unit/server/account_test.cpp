// SPDX-License-Identifier: Apache-2.0
// Memory accounts and gates: charges are returned in any order of events, and limits refuse without changing
// anything.
#include "server/session/account.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
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

// Found by a user: a limit that was lowered to another one does not rise by itself.
TEST(AccountTest, ARefusalNamesTheSettingThatHelps) {
  Budget budget(1000);
  const auto of_all = Account::open(budget, 1000, 1001);
  ASSERT_FALSE(of_all.ok());
  EXPECT_STREQ(of_all.fault().limit, "max-session-bytes");
  EXPECT_THAT(of_all.fault().message,
              HasSubstr("raise --max-total-bytes, which is met as well, and --max-session-bytes"));
  EXPECT_THAT(Account::open(budget, 999, 1000).fault().message, HasSubstr("raise --max-session-bytes"));
}

TEST(AccountTest, WhatNeverFitsIsNotWorthTryingAgain) {
  Budget budget(1000);
  const auto never = Account::open(budget, 5000, 1001);
  ASSERT_FALSE(never.ok());
  EXPECT_STREQ(never.fault().limit, "max-total-bytes");
  EXPECT_FALSE(never.fault().retry_after);
  EXPECT_THAT(never.fault().message, HasSubstr("split the scene"));
  const auto small = Account::open(budget, 5000, 100).value();
  EXPECT_TRUE(small->refusal(1001) && !small->refusal(1001)->retry_after);
  const auto other = Account::open(budget, 5000, 100).value();
  EXPECT_TRUE(small->refusal(950) && small->refusal(950)->retry_after);
}

TEST(AccountTest, AFullDaemonRefusesOnlySessionsBeyondTheirReservation) {
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
  Gate streams(9), frames(9);
  Quota quota{.sessions = 9, .bytes = 500, .streams = 2, .frames = 2, .uploads = 1, .weight = 1};
  Tenants tenants(quota, streams, frames);
  const auto open = [&](const char* name, std::size_t reserved) {
    const std::shared_ptr<Tenant> tenant = tenants.of(name);
    return Account::open(budget, 2000, reserved, std::shared_ptr<Budget>(tenant, &tenant->memory));
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
  EXPECT_EQ(tenants.of("carol")->memory.used(), 0u);

  // Only the principal that exceeds its share is refused.
  Holding grown(alices, 600);
  ASSERT_TRUE(alices->refusal());
  EXPECT_STREQ(alices->refusal()->limit, "max-principal-bytes");
  EXPECT_FALSE(bobs->refusal());
  grown.set(0);
  EXPECT_FALSE(alices->refusal());
  grown = Holding();
  alices.reset();
  EXPECT_EQ(tenants.of("alice")->memory.used(), 0u);
  EXPECT_TRUE(open("alice", 500).ok());
}

TEST(AccountTest, ManyThreadsReleaseAllCharges) {
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

TEST(TenantsTest, EachHasItsQuotaWithinTheDaemonsLimits) {
  Gate streams(3), frames(9);
  Tenants tenants(Quota{.sessions = 9, .bytes = 500, .streams = 2, .frames = 2, .uploads = 1, .weight = 1},
                  streams, frames);
  const auto alice = tenants.of("alice"), bob = tenants.of("bob");
  EXPECT_EQ(tenants.of("alice"), alice);
  auto first = alice->streams.enter(), second = alice->streams.enter();
  EXPECT_TRUE(first && second);
  EXPECT_FALSE(alice->streams.enter());
  EXPECT_STREQ(gate_met(alice->streams, streams, "", "streams", "all", "own").limit, "own");
  const auto third = bob->streams.enter();
  EXPECT_TRUE(third);
  EXPECT_FALSE(bob->streams.enter()) << "the daemon is full";
  EXPECT_STREQ(gate_met(bob->streams, streams, "", "streams", "all", "own").limit, "all");
  EXPECT_EQ(streams.inside(), 3u);
  EXPECT_EQ(bob->streams.inside(), 1u) << "a refused client is not counted";
  first.reset();
  EXPECT_EQ(streams.inside(), 2u);
  // Changed quotas apply at once, and to later principals.
  tenants.set_quotas(
      parse_quotas(std::vector<std::string>{"alice streams=1 weight=7", "carol bytes=1MiB"}).value());
  EXPECT_FALSE(alice->streams.enter());
  EXPECT_EQ(alice->share.weight(), 7u);
  EXPECT_EQ(tenants.of("carol")->quota().bytes, std::size_t{1} << 20);
  EXPECT_EQ(tenants.of("carol")->quota().streams, 2u);
  tenants.set_quotas({});
  EXPECT_TRUE(alice->streams.enter());
  EXPECT_EQ(alice->share.weight(), 1u);
  EXPECT_EQ(tenants.list().size(), 2u) << "carol has nothing here";
}

// The last object of a tenant may be a stream whose session was deleted before.
TEST(TenantsTest, ATicketKeepsItsTenant) {
  Gate streams(3), frames(9);
  Tenants tenants(Quota{.sessions = 9, .bytes = 500, .streams = 2, .frames = 2, .uploads = 1, .weight = 1},
                  streams, frames);
  std::shared_ptr<Tenant> alice = tenants.of("alice");
  std::optional<Gate::Ticket> ticket = alice->streams.enter(alice);
  const std::weak_ptr<Tenant> seen = alice;
  alice.reset();
  EXPECT_FALSE(seen.expired());
  EXPECT_EQ(streams.inside(), 1u);
  ticket.reset();
  EXPECT_TRUE(seen.expired());
  EXPECT_EQ(streams.inside(), 0u);
}

TEST(QuotaTest, IsReadFromWordsAndLeavesRoomForOthers) {
  const auto quotas = parse_quotas(std::vector<std::string>{
      "alice sessions=8 bytes=4GiB streams=8 frames=32 uploads=2 weight=3", "bob weight=2"});
  ASSERT_TRUE(quotas.ok()) << quotas.error().message;
  const Limits limits;
  const Quota all = default_quota(limits, false), some = default_quota(limits, true);
  EXPECT_EQ(all.sessions, limits.max_sessions);
  EXPECT_EQ(some.sessions, limits.max_sessions / 4 * 3);
  EXPECT_EQ(some.uploads, limits.max_sessions / 4);
  EXPECT_EQ(quotas.value().at("alice").over(some), (Quota{8, std::size_t{4} << 30, 8, 32, 2, 3}));
  EXPECT_EQ(quotas.value().at("bob").over(some).streams, some.streams);
  for (const char* bad : {"alice", "", "alice sessions", "alice sessions=", "alice sessions=0", "alice x=1",
                          "alice weight=1001", "alice bytes=1"})
    EXPECT_FALSE(parse_quotas(std::vector<std::string>{bad}).ok()) << bad;
  EXPECT_FALSE(parse_quotas(std::vector<std::string>{"bob weight=1", "bob weight=2"}).ok());
  Limits one;
  one.max_sessions = 1;
  EXPECT_EQ(default_quota(one, true).sessions, 1u);
}

TEST(GateTest, AdmitsAsManyAsItsLimit) {
  Gate gate(2);
  Budget budget(1 << 20);
  const auto account = Account::open(budget, 1 << 20, 0).value();
  std::optional<FramePass> first = admit_frame(gate, gate, account, 100);
  const FramePass second = admit_frame(gate, gate, account, 10);
  EXPECT_FALSE(first->refused || second.refused);
  const FramePass third = admit_frame(gate, gate, account, 10);
  ASSERT_TRUE(third.refused);
  EXPECT_STREQ(third.refused->limit, "max-frames-per-principal");
  EXPECT_EQ(gate.inside(), 2u);
  EXPECT_EQ(account->held(), 120u);
  first.reset();
  EXPECT_EQ(gate.inside(), 1u);
  EXPECT_TRUE(gate.enter());
}

TEST(EstimateTest, GrowsWithTheScene) {
  const Limits limits;
  EXPECT_GT(estimate_bytes(1000, 2000, 8, false, false, limits),
            estimate_bytes(1000, 2000, 4, false, false, limits));
  EXPECT_GT(estimate_bytes(0, 0, 4, false, false, limits), 0u);
  EXPECT_GT(estimate_bytes(16'000'000, 16'000'000, 8, false, false, limits), std::size_t{16} << 30);
}

TEST(EstimateTest, IncludesTheSecondColliderOfExplain) {
  const Limits limits;
  const std::size_t alone = estimate_bytes(100'000, 200'000, 8, false, false, limits);
  const std::size_t frames = (limits.window + 1) * 24 * 100'000;
  EXPECT_GT(estimate_bytes(100'000, 200'000, 8, true, false, limits), 2 * alone - frames - (1 << 20));
}

}  // namespace
}  // namespace warmfront::server

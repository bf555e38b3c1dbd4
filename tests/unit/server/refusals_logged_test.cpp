// SPDX-License-Identifier: Apache-2.0
// Who is refused is in the log, and whoever tries again and again does not fill it.
#include <gmock/gmock.h>
#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>

#include <chrono>
#include <cstdint>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>
#include <thread>
#include <vector>

#include "tests/unit/server/local_daemon.h"
#include "tests/unit/server/log_events.h"
#include "tests/unit/server/service_fixture.h"
#include "tests/unit/server/three_tokens.h"

namespace warmfront::test {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

/// Repeats an attempt for a little more than a second: its lines are few, and account for all attempts.
template <class Attempt>
void expect_few_lines(const LocalDaemon& daemon, const std::string& name, Attempt attempt) {
  const auto start = std::chrono::steady_clock::now();
  std::uint64_t attempts = 0;
  for (; std::chrono::steady_clock::now() - start < std::chrono::milliseconds(1200); ++attempts) attempt();
  std::this_thread::sleep_for(std::chrono::milliseconds(1100));
  attempt();
  ++attempts;
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - start;
  const std::vector<nlohmann::json> lines = events_of(daemon.log(), name);
  ASSERT_FALSE(lines.empty());
  EXPECT_LE(static_cast<double>(lines.size()), took.count() + 1);
  std::uint64_t told = lines.size();
  for (const nlohmann::json& line : lines) told += line["left_out"].get<std::uint64_t>();
  EXPECT_EQ(told, attempts) << "the last line has all that were left out before it";
}

TEST(RefusalsLoggedTest, UnknownCallersAreNamedByTheirAddressOnceASecond) {
  const TemporaryFolder folder;
  server::Config config;
  config.token_file = folder.path() / "tokens";
  std::ofstream(config.token_file) << kAliceToken << " alice\n";
  const LocalDaemon daemon(config);
  const auto stub = v1::CollisionService::NewStub(
      grpc::CreateChannel(daemon.address(), grpc::InsecureChannelCredentials()));
  const auto call = [&](const char* token) {
    grpc::ClientContext context;
    context.AddMetadata("authorization", std::string("Bearer ") + token);
    v1::ListSessionsResponse listed;
    return stub->ListSessions(&context, {}, &listed).error_code();
  };
  EXPECT_EQ(call(kAliceToken), grpc::StatusCode::OK);
  EXPECT_TRUE(events_of(daemon.log(), "unauthenticated").empty());
  constexpr const char* kGuessed = "guessed-0123456789abcdef";
  expect_few_lines(daemon, "unauthenticated",
                   [&] { EXPECT_EQ(call(kGuessed), grpc::StatusCode::UNAUTHENTICATED); });
  const nlohmann::json line = events_of(daemon.log(), "unauthenticated").front();
  EXPECT_EQ(line["level"], "warning");
  EXPECT_THAT(line["peer"].get<std::string>(), HasSubstr("unix:"));
  EXPECT_THAT(line["reason"].get<std::string>(), HasSubstr("the token that came is unknown here"));
  EXPECT_FALSE(line["request_id"].get<std::string>().empty());
  EXPECT_THAT(daemon.log(), Not(HasSubstr(kGuessed))) << "it may be somebody's with a mistake in it";
}

TEST_F(SmallLimitsTest, RefusedCreatesAreLoggedOnceASecondForEachReason) {
  ASSERT_TRUE(create().ok());
  expect_few_lines(daemon_, "create_refused",
                   [&] { EXPECT_EQ(create(kOther).error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED); });
  const v1::SessionHeader other = header("no id");
  const std::size_t before = events_of(daemon_.log(), "create_refused").size();
  EXPECT_EQ(create(other, "", "").error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_EQ(events_of(daemon_.log(), "create_refused").size(), before + 1)
      << "another reason has a line of its own";
}

}  // namespace
}  // namespace warmfront::test

// SPDX-License-Identifier: Apache-2.0
// What a daemon says of settings that may not be meant.
#include "server/config_remarks.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <fstream>
#include <string>
#include <thread>

#include "tests/unit/server/local_daemon.h"
#include "tests/unit/server/three_tokens.h"
#include "tests/unit/server/warmfrontd_process.h"

namespace warmfront::test {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

TEST(ContradictionsTest, NoPrincipalGetsMoreThanAll) {
  server::Config config;
  EXPECT_THAT(server::contradictions(config), IsEmpty());
  config.limits.max_sessions = 10;
  config.limits.max_sessions_per_principal = 10;
  EXPECT_THAT(server::contradictions(config), IsEmpty());
  config.limits.max_sessions_per_principal = 20;
  config.limits.max_total_bytes = std::size_t{1} << 30;
  config.limits.max_principal_bytes = std::size_t{2} << 30;
  EXPECT_THAT(
      server::contradictions(config),
      ElementsAre("max-sessions-per-principal is 20, and max-sessions 10: no principal gets more than "
                  "that; lower the one or raise the other",
                  HasSubstr("max-principal-bytes is 2.0 GiB, and max-total-bytes 1.0 GiB")));
  config.limits = {};
  config.limits.max_open_streams = 3;
  config.limits.max_frames_in_flight = 5;
  config.limits.max_streams_per_principal = 4;
  config.limits.max_frames_per_principal = 6;
  config.limits.max_uploads_per_principal = config.limits.max_sessions + 1;
  EXPECT_THAT(server::contradictions(config),
              ElementsAre(HasSubstr("max-streams-per-principal is 4, and max-open-streams 3"),
                          HasSubstr("max-frames-per-principal is 6, and max-frames-in-flight 5"),
                          HasSubstr("max-uploads-per-principal is 257, and max-sessions 256")));
}

TEST(ContradictionsTest, QuotasAreBelowWhatAllMayHaveAndOfPrincipalsThatAreToldApart) {
  server::Config config;
  config.token_file = "tokens";
  config.limits.max_sessions = 10;
  config.quotas = {"alice sessions=8 weight=3", "bob sessions=11 streams=2"};
  config.admins = {"carol"};
  EXPECT_THAT(server::contradictions(config),
              ElementsAre(HasSubstr("quotas: bob's sessions= is 11, and max-sessions 10")));
  config.quotas = {"alice sessions=8"};
  config.token_file.clear();
  EXPECT_THAT(server::contradictions(config), ElementsAre(HasSubstr("quotas names principals, and callers"),
                                                          HasSubstr("admins names principals, and callers")));
  config.tls.client_ca = "ca.pem";
  EXPECT_THAT(server::contradictions(config), IsEmpty());
}

TEST(ReloadTest, SaysWhatWasReadAndWhoHasNoToken) {
  const TemporaryFolder folder;
  const std::string tokens = folder.path() / "tokens";
  std::ofstream(tokens) << kAliceToken << " alice\n" << kBobToken << " bob\n";
  server::Config config;
  config.token_file = tokens;
  config.admins = {"alice", "alcie"};
  config.quotas = {"bob sessions=2"};
  LocalDaemon daemon(config);
  const std::string nobody = "\"principal\":\"alcie\",\"reason\":\"admins or quotas name a principal";
  EXPECT_THAT(daemon.log(), HasSubstr(nobody));
  EXPECT_THAT(daemon.log(), Not(HasSubstr("\"principal\":\"bob\"")));
  std::ofstream(tokens) << kAliceToken << " alice\n";
  EXPECT_TRUE(daemon->reload());
  EXPECT_THAT(daemon.log(), HasSubstr("\"ok\":true,\"read\":\"token file (1 token in force)\""));
  EXPECT_THAT(daemon.log(), HasSubstr("\"principal\":\"bob\",\"reason\":\"admins or quotas"));
}

// The daemon takes no other settings over while it runs, and says so where the file has others.
TEST(ReloadTest, SaysWhatOfTheConfigurationFileIsNotInForce) {
  const TemporaryFolder folder;
  const std::string file = folder.path() / "config.toml";
  std::ofstream(file) << "max-sessions = 3\n";
  Process daemon(folder.path(), {"--config", file});
  const auto logs = [&](const std::string& words) {
    for (int i = 0; i < 2000 && daemon.log().find(words) == std::string::npos; ++i)
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    return daemon.log().find(words) != std::string::npos;
  };
  ASSERT_TRUE(logs("serving"));
  daemon.reload();
  EXPECT_TRUE(logs("nothing: there is neither a token file nor a certificate"));
  std::ofstream(file) << "max-sessions = 7\n";
  daemon.reload();
  EXPECT_TRUE(logs(R"(max-sessions is \"7\" now, and \"3\" is in force: restart the daemon for it)"));
  std::ofstream(file) << "max-sesions = 7\n";
  daemon.reload();
  EXPECT_TRUE(logs("the daemon would not start with the configuration as it is now; " + file +
                   ": line 1: max-sesions is no setting; the nearest is max-sessions"));
  daemon.terminate();
  EXPECT_EQ(daemon.wait(), 0);
}

}  // namespace
}  // namespace warmfront::test

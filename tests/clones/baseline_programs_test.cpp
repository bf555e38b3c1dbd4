// SPDX-License-Identifier: Apache-2.0
// Both programs go on as those beside them that are made for machines without AVX2, with their arguments.
#include <gtest/gtest.h>

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "engine/instructions.h"
#include "tests/support/command.h"
#include "tests/unit/client/temporary_folder.h"

namespace warmfront::test {
namespace {

constexpr const char* kBench =
    " bench 'builtin:bart?triangles=1000&frames=6' --threads-list 1 --ablations none --rounds 1 --json -";
const std::string kAsBaseline = "WARMFRONT_INSTRUCTIONS=baseline ";

nlohmann::json bench(const std::string& program) {
  const CommandOutcome outcome = run_command(program + kBench + " 2>/dev/null");
  EXPECT_EQ(outcome.code, 0);
  return nlohmann::json::parse(outcome.out, nullptr, false);
}

/// Of a text that holds it somewhere.
bool says(const nlohmann::json& report, const std::string& text) {
  return report.dump().find('"' + text + '"') != std::string::npos;
}

TEST(BaselinePrograms, AnswerAsTheOthers) {
  const nlohmann::json own = bench(WARMFRONT_BINARY), baseline = bench(kAsBaseline + WARMFRONT_BINARY);
  EXPECT_TRUE(says(baseline, "baseline"));
  EXPECT_EQ(says(own, "baseline"), baseline_is_faster());
  const auto hashes = [](const nlohmann::json& report) {
    std::vector<std::string> all;
    const std::string text = report.dump();
    for (std::size_t at = text.find("\"hash\":"); at != std::string::npos;
         at = text.find("\"hash\":", at + 1))
      all.push_back(text.substr(at, 32));
    return all;
  };
  EXPECT_FALSE(hashes(own).empty());
  EXPECT_EQ(hashes(own), hashes(baseline));
}

TEST(BaselinePrograms, PassExitCodesAndMessages) {
  const std::string refused = std::string(WARMFRONT_BINARY) + " no-such-verb 2>&1";
  const CommandOutcome own = run_command(refused), baseline = run_command(kAsBaseline + refused);
  EXPECT_EQ(own.code, 3);
  EXPECT_EQ(baseline.code, own.code);
  EXPECT_EQ(baseline.out, own.out);
}

TEST(BaselinePrograms, WhatIsNoSetOfInstructionsIsRefused) {
  const CommandOutcome outcome =
      run_command(std::string("WARMFRONT_INSTRUCTIONS=sse9 ") + WARMFRONT_BINARY + " --version 2>&1");
  EXPECT_EQ(outcome.code, 3);
  EXPECT_NE(outcome.out.find("WARMFRONT_INSTRUCTIONS: \"sse9\""), std::string::npos) << outcome.out;
  EXPECT_EQ(run_command(std::string("WARMFRONT_INSTRUCTIONS= ") + WARMFRONT_BINARY + " --version").code, 0);
}

TEST(BaselinePrograms, AProgramThatIsAloneRunsItself) {
  const client::TemporaryFolder folder;
  const std::filesystem::path alone = std::filesystem::path(folder.path()) / "bin" / "warmfront";
  std::filesystem::create_directory(alone.parent_path());
  std::filesystem::copy_file(WARMFRONT_BINARY, alone);
  EXPECT_FALSE(says(bench(kAsBaseline + alone.string()), "baseline"));
}

TEST(BaselinePrograms, TheDaemonIsOneToo) {
  const client::TemporaryFolder folder;
  const CommandOutcome outcome = run_command("cd " + folder.path() + "; " + kAsBaseline + WARMFRONT_DAEMON +
                                             " --listen unix:d.sock >log 2>&1 & until grep -q serving log; "
                                             "do kill -0 $! || exit 1; sleep 0.1; done; "
                                             "readlink /proc/$!/exe; kill $!; wait $!");
  EXPECT_EQ(outcome.code, 0);
  EXPECT_NE(outcome.out.find("/libexec/warmfront/warmfrontd"), std::string::npos) << outcome.out;
  EXPECT_EQ(folder.read("log").find("INSTRUCTIONS"), std::string::npos) << "it is no setting";
}

}  // namespace
}  // namespace warmfront::test

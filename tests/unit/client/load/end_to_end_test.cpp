// SPDX-License-Identifier: Apache-2.0
// `warmfront load` as a user runs it, against a daemon: its counts are the daemon's own, its answers the
// engine's.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <fstream>
#include <future>
#include <regex>
#include <sstream>
#include <thread>

#include "client/cli/exit_codes.h"
#include "tests/unit/client/command.h"
#include "tests/unit/server/http_get.h"
#include "tests/unit/server/local_daemon.h"

namespace warmfront::client {
namespace {

using ::testing::AnyOf;
using ::testing::HasSubstr;
using ::testing::StartsWith;
using Json = nlohmann::ordered_json;

constexpr const char* kScene = " --scene 'builtin:cloth-ball?triangles=1000&frames=12'";

class LoadEndToEnd : public ::testing::Test {
 protected:
  static server::Config config() {
    server::Config config;
    config.metrics_listen = "127.0.0.1:0";
    return config;
  }
  Outcome load(const std::string& arguments, const std::string& streams = "2>&1") {
    return run("load --server " + daemon_.address() + kScene + " " + arguments, streams);
  }
  std::string file(const std::string& name) const { return (folder_.path() / name).string(); }
  static std::string text_of(const std::string& path) {
    std::stringstream text;
    text << std::ifstream(path).rdbuf();
    return text.str();
  }
  /// The sum of a metric over its labels.
  std::uint64_t metric(const std::string& name) {
    const std::string text = test::get(daemon_->metrics_port(), "/metrics");
    const std::regex line("\n" + name + "(\\{[^}]*\\})? ([0-9]+)");
    std::uint64_t sum = 0;
    for (auto it = std::sregex_iterator(text.begin(), text.end(), line); it != std::sregex_iterator(); ++it)
      sum += std::stoull((*it)[2]);
    return sum;
  }

  test::TemporaryFolder folder_;
  test::LocalDaemon daemon_{config()};
};

TEST_F(LoadEndToEnd, CountsWhatTheDaemonCountsAndGetsTheEnginesAnswers) {
  const std::string json_file = file("r.json"), csv_file = file("r.csv"), html_file = file("r.html");
  const Outcome outcome =
      load("--sessions 2:4:x2 --duration 1s --warmup 200ms --check --limit errors=0 --json " + json_file +
           " --csv " + csv_file + " --html " + html_file);
  ASSERT_EQ(outcome.code, kExitOk) << outcome.out;
  EXPECT_THAT(outcome.out, HasSubstr("kept errors=0 (0)"));
  const Json report = Json::parse(text_of(json_file));
  ASSERT_EQ(report["points"].size(), 2u);
  std::uint64_t frames = 0, contacts = 0, sessions = 0;
  for (const Json& point : report["points"]) {
    const Json& counts = point["counts"];
    EXPECT_GT(counts["frames"].get<std::uint64_t>(), 0u);
    EXPECT_EQ(counts["checked"], counts["all_frames"]);
    EXPECT_EQ(counts["different"], 0);
    EXPECT_EQ(point["ms"]["latency"]["count"], counts["frames"]);
    EXPECT_EQ(point["ms"]["cold_first_frame"]["count"], counts["sessions_created"]);
    frames += counts["all_frames"].get<std::uint64_t>();
    contacts += counts["all_contacts"].get<std::uint64_t>();
    sessions += counts["sessions_created"].get<std::uint64_t>();
  }
  EXPECT_EQ(sessions, 6u);
  EXPECT_GT(contacts, 0u);
  EXPECT_EQ(metric("warmfront_steps_total"), frames);
  EXPECT_EQ(metric("warmfront_contacts_total"), contacts);
  EXPECT_EQ(metric("warmfront_sessions_created_total"), sessions);
  EXPECT_EQ(metric("warmfront_queue_duration_seconds_count"), frames);
  EXPECT_EQ(metric("warmfront_sessions"), 0u) << "a load leaves no session behind";

  std::istringstream csv(text_of(csv_file));
  std::string line;
  std::size_t lines = 0, fields = 0;
  for (; std::getline(csv, line); ++lines) {
    const auto commas = static_cast<std::size_t>(std::ranges::count(line, ','));
    if (lines > 0) {
      EXPECT_EQ(commas, fields);
    }
    fields = commas;
  }
  EXPECT_EQ(lines, 3u);
  const std::string html = text_of(html_file);
  EXPECT_THAT(html, StartsWith("<!DOCTYPE html>"));
  EXPECT_THAT(html, HasSubstr("<svg"));
  EXPECT_FALSE(std::regex_search(html, std::regex("(src|href)=|url\\(|@import|<script")))
      << "the page needs nothing from elsewhere";
}

TEST_F(LoadEndToEnd, AnOpenLoopSendsAtItsRate) {
  const Outcome outcome = load(
      "--sessions 2 --rate 40 --duration 2s --warmup 100ms --send moved --check --json -", "2>/dev/null");
  ASSERT_EQ(outcome.code, kExitOk);
  const Json point = Json::parse(outcome.out)["points"][0];
  const auto due = point["counts"]["frames"].get<int>() + point["counts"]["unsent"].get<int>();
  EXPECT_NEAR(due, 80, 2) << "as many frames as are due, however fast answers arrive";
  EXPECT_EQ(point["arrival"], "constant");
}

TEST_F(LoadEndToEnd, AMixAsksWhatItSaysAndGetsTheEnginesAnswers) {
  for (const char* send : {"all", "moved"}) {
    SCOPED_TRACE(send);
    const Outcome outcome = load(
        std::string("--sessions 2 --duration 1s --warmup 0s --check --limit errors=0 --json - --distance 0.02 "
                    "--mix max_step=1,trial=2,commit=1,step=1,proximity=1,intersections=1 --send ") +
            send,
        "2>/dev/null");
    ASSERT_EQ(outcome.code, kExitOk) << outcome.out;
    const Json point = Json::parse(outcome.out)["points"][0];
    EXPECT_EQ(point["mix"], "max_step=1,trial=2,commit=1,step=1,proximity=1,intersections=1");
    EXPECT_EQ(point["counts"]["checked"], point["counts"]["all_frames"]);
    EXPECT_EQ(point["counts"]["different"], 0);
    const Json& questions = point["ms"]["questions"];
    const auto count = [&](const char* name) { return questions[name]["count"].get<int>(); };
    EXPECT_GT(count("commit"), 2);
    EXPECT_NEAR(count("trial"), 2 * count("commit"), 4) << "each session is within a cycle at the end";
    EXPECT_NEAR(count("max_step"), count("commit"), 2);
    EXPECT_NEAR(count("step"), count("commit"), 2);
    EXPECT_NEAR(count("proximity"), count("commit"), 2);
    EXPECT_NEAR(count("intersections"), count("commit"), 2);
    int all = 0;
    for (const auto& [name, latency] : questions.items()) {
      all += latency["count"].get<int>();
      EXPECT_GE(latency["p99"], latency["p50"]) << name;
    }
    EXPECT_EQ(all, point["counts"]["frames"].get<int>());
  }
  const Outcome text = load("--duration 200ms --warmup 0s --mix trial=1,commit=1 --csv " + file("mix.csv"));
  EXPECT_EQ(text.code, kExitOk);
  EXPECT_THAT(text.out, HasSubstr("each session asks trial=1,commit=1 in turn"));
  EXPECT_THAT(text.out, HasSubstr("| commit"));
  EXPECT_THAT(text_of(file("mix.csv")), HasSubstr("trial_p99_ms"));
}

TEST_F(LoadEndToEnd, ExitsWith1WhereALimitIsMissed) {
  const Outcome outcome = load("--duration 200ms --warmup 0s --limit max=1us --limit errors=0");
  EXPECT_EQ(outcome.code, kExitNo);
  EXPECT_THAT(outcome.out, HasSubstr("missed max=0.001ms by "));
  EXPECT_EQ(load("--duration 100ms --warmup 0s --knee max=1us --rate 1000").code, kExitNo)
      << "no rate meets the limit";
}

TEST_F(LoadEndToEnd, CountsErrorsByTheirCode) {
  server::Config small = config();
  small.limits.max_sessions = 1;
  test::LocalDaemon full(small);
  const Outcome outcome = run("load --server " + full.address() + kScene +
                                  " --sessions 3 --duration 300ms --warmup 0s --limit errors=0 --json -",
                              "2>/dev/null");
  EXPECT_EQ(outcome.code, kExitNo);
  const Json point = Json::parse(outcome.out)["points"][0];
  EXPECT_GT(point["errors_by_code"]["RESOURCE_EXHAUSTED"].get<int>(), 1);
  EXPECT_GT(point["counts"]["frames"].get<int>(), 0) << "the session that was taken goes on";
  const Outcome unlimited =
      run("load --server " + full.address() + kScene + " --sessions 3 --duration 300ms --warmup 0s");
  EXPECT_EQ(unlimited.code, kExitFailed);
  EXPECT_THAT(unlimited.out, HasSubstr("2 of 3 sessions were missing at the end: "));
  EXPECT_THAT(unlimited.out, AnyOf(HasSubstr("max-sessions"), HasSubstr("quota of 1 uploads")))
      << "the limit that refused them, whichever was met first";
}

TEST_F(LoadEndToEnd, AnOutageIsInTheReport) {
  std::future<Outcome> running = std::async(std::launch::async, [this] {
    return load("--sessions 2 --duration 5s --warmup 0s --json " + file("r.json") + " --html " +
                file("r.html"));
  });
  while (metric("warmfront_steps_total") < 20 &&
         running.wait_for(std::chrono::milliseconds(10)) == std::future_status::timeout) {
  }
  daemon_.stop();
  std::this_thread::sleep_for(std::chrono::milliseconds(500));
  daemon_.start();
  const Outcome outcome = running.get();
  EXPECT_EQ(outcome.code, kExitOk) << outcome.out;
  EXPECT_THAT(outcome.out, HasSubstr("warning: no session had a daemon that served it for "));
  EXPECT_THAT(text_of(file("r.html")), HasSubstr("no session had a daemon"));
  const Json point = Json::parse(text_of(file("r.json")))["points"][0];
  EXPECT_GT(point["unserved_seconds"], 0);
  EXPECT_LT(point["unserved_seconds"], point["measured_seconds"]);
  EXPECT_EQ(point["counts"]["errors"], 0) << "the sessions were resumed";
}

TEST_F(LoadEndToEnd, UsageErrorsTakeOneLine) {
  for (const char* wrong :
       {"--sessions 0", "--sessions 1.5", "--sessions 5000", "--sessions 2:1:x2", "--rate -1", "--duration 5",
        "--duration 0s", "--limit p42=1ms", "--limit p99=20", "--poisson", "--mix trial=0", "--mix look=1",
        "--mix commit=1", "--mix trial=1,trial=2", "--mix proximity=1", "--mix trial=1 --distance 1",
        "--mix proximity=1 --distance -1", "--mix trial=1 --record .", "--knee p99=1ms --rate 1:4:x2",
        "--check --send poses"}) {
    const Outcome outcome = load(wrong);
    EXPECT_EQ(outcome.code, kExitUsage) << wrong << "\n" << outcome.out;
    EXPECT_EQ(std::ranges::count(outcome.out, '\n'), 1) << outcome.out;
  }
}

}  // namespace
}  // namespace warmfront::client

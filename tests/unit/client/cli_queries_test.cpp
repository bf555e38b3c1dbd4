// SPDX-License-Identifier: Apache-2.0
// `warmfront queries` as others use it: its exit codes, its JSON and CSV to the letter.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <sstream>

#include "client/cli/exit_codes.h"
#include "tests/unit/client/command.h"
#include "tests/unit/client/known_queries.h"
#include "tests/unit/client/temporary_folder.h"

namespace warmfront::client {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using Json = nlohmann::ordered_json;

class CliQueries : public ::testing::Test {
 protected:
  void SetUp() override {
    for (const char* kind : {"set/vertex-face", "set/edge-edge"})
      std::filesystem::create_directories(folder_.file(kind));
    folder_.write("set/vertex-face/a.csv", falling_vertex("1,4", "-1,1", '1') +
                                               falling_vertex("3,1", "-1,1", '0') +
                                               falling_vertex("1,4", "0,1", '1'));
    folder_.write("set/edge-edge/a.csv", falling_edge("0,1", '1') + falling_edge("2,1", '0'));
  }
  std::string set() const { return folder_.file("set"); }
  TemporaryFolder folder_;
};

TEST_F(CliQueries, JsonHasTheFieldsThatToolsRead) {
  const Outcome outcome = run("queries " + set() + " --json -", "2>/dev/null");
  ASSERT_EQ(outcome.code, kExitOk);
  const Json json = Json::parse(outcome.out);
  EXPECT_THAT(keys(json), ElementsAre("tier", "vf", "ee"));
  EXPECT_EQ(json["tier"], "certified");
  for (const char* kind : {"vf", "ee"}) {
    EXPECT_THAT(keys(json[kind]), ElementsAre("queries", "false_positives", "false_negatives", "possible",
                                              "ns_per_query", "ns_max"));
    EXPECT_EQ(json[kind]["false_positives"], 0);
    EXPECT_EQ(json[kind]["false_negatives"], 0);
    EXPECT_GT(json[kind]["ns_per_query"], 0);
    EXPECT_GE(json[kind]["ns_max"], json[kind]["ns_per_query"]);
  }
  EXPECT_EQ(json["vf"]["queries"], 3);
  EXPECT_EQ(json["ee"]["queries"], 2);
  EXPECT_EQ(json["vf"]["possible"], 1);  // touching at the very end is what certified cannot prove
}

TEST_F(CliQueries, EachQueryIsALineOfTheCsv) {
  const Outcome outcome = run("queries " + set() + " --per-query " + folder_.file("out.csv"));
  ASSERT_EQ(outcome.code, kExitOk) << outcome.out;
  EXPECT_THAT(outcome.out, HasSubstr("false negatives"));
  std::istringstream lines(folder_.read("out.csv"));
  std::vector<std::string> rows;
  for (std::string line; std::getline(lines, line);) rows.push_back(line);
  ASSERT_EQ(rows.size(), 6U);
  EXPECT_EQ(rows[0], "file,index,type,truth,answer,toi");
  EXPECT_EQ(rows[2], folder_.file("set/edge-edge/a.csv") + ",1,ee,0,0,");
  EXPECT_THAT(rows[3], ::testing::StartsWith(folder_.file("set/vertex-face/a.csv") + ",0,vf,1,1,0.49999"));
  EXPECT_EQ(rows[4], folder_.file("set/vertex-face/a.csv") + ",1,vf,0,0,");
}

TEST_F(CliQueries, ABrokenPromiseIsExitCode1) {
  const std::string wrong =
      folder_.write("vf.csv", falling_vertex("3,1", "-1,1", '1'));  // says contact where there is none
  EXPECT_EQ(run("queries " + wrong).code, kExitNo);
  EXPECT_EQ(run("queries " + set() + " " + wrong + " --json -", "2>/dev/null").code, kExitNo);
  // The certified tier may report false positives.
  const std::string extra = folder_.write("ee.csv", falling_edge("0,1", '0'));
  EXPECT_EQ(run("queries " + extra).code, kExitOk);
  EXPECT_EQ(Json::parse(run("queries " + extra + " --json -", "2>/dev/null").out)["ee"]["false_positives"],
            1);
}

TEST_F(CliQueries, TheTypeOverridesThePath) {
  const std::string free = folder_.write("free.csv", falling_edge("0,1", '1'));
  const Outcome untold = run("queries " + free);
  EXPECT_EQ(untold.code, kExitFailed);
  EXPECT_THAT(untold.out, HasSubstr("free.csv: nothing in the path says vertex-face or edge-edge"));
  EXPECT_EQ(Json::parse(run("queries --type ee --json - " + free, "2>/dev/null").out)["ee"]["queries"], 1);
  EXPECT_EQ(Json::parse(run("queries --type vf --json - " + free, "2>/dev/null").out)["vf"]["queries"], 1);
}

TEST_F(CliQueries, WhatCannotBeReadExitsWith2AndWhatMakesNoSenseWith3) {
  const std::string broken = folder_.write("vf.csv", falling_vertex("1,4", "-1,1", '1') + "1,3,0,1,0,1,1\n");
  const Outcome outcome = run("queries " + broken);
  EXPECT_EQ(outcome.code, kExitFailed);
  EXPECT_THAT(outcome.out, HasSubstr("vf.csv: line 9: x is not exactly a double"));
  EXPECT_EQ(run("queries " + folder_.file("none.csv")).code, kExitFailed);
  EXPECT_EQ(run("queries " + set() + " --json " + folder_.file("no/r.json")).code, kExitFailed);
  EXPECT_EQ(run("queries " + set() + " --per-query " + folder_.file("no/r.csv")).code, kExitFailed);
  for (const char* arguments : {"", " --tier sharp", " --tolerance 0", " --tolerance 2", " --repeat 0",
                                " --type xy", " --min-separation -1", " --bogus"}) {
    const Outcome misuse = run("queries " + (*arguments == '\0' ? "" : set() + arguments));
    EXPECT_EQ(misuse.code, kExitUsage) << arguments << ": " << misuse.out;
    EXPECT_EQ(std::count(misuse.out.begin(), misuse.out.end(), '\n'), 1) << misuse.out;
  }
}

TEST_F(CliQueries, SeparationWidensWhatIsReported) {
  const auto positives = [&](const std::string& options) {
    return Json::parse(
        run("queries " + set() + " --json - " + options, "2>/dev/null").out)["vf"]["false_positives"];
  };
  EXPECT_EQ(positives("--min-separation 1"), 0);
  EXPECT_EQ(positives("--min-separation 2.5"), 1);
}

}  // namespace
}  // namespace warmfront::client

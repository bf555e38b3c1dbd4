// SPDX-License-Identifier: Apache-2.0
// `warmfront accuracy` from outside: the tiers keep their guarantees in its measurements, in every output
// format.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <sstream>

#include "client/cli/exit_codes.h"
#include "client/io/ply.h"
#include "tests/unit/client/command.h"
#include "tests/unit/client/known_queries.h"
#include "tests/unit/client/temporary_folder.h"

namespace warmfront::client {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using Json = nlohmann::ordered_json;

constexpr const char* kMeasuredScene = "'builtin:bart?triangles=1000' --frames 0:3";

class CliAccuracy : public ::testing::Test {
 protected:
  void SetUp() override {
    for (const char* kind : {"hard/vertex-face", "hard/edge-edge"})
      std::filesystem::create_directories(folder_.file(kind));
    // The last vertex passes the face's edge by less than float32's resolution: rounded, it hits.
    folder_.write("hard/vertex-face/a.csv",
                  falling_vertex("1,4", "-1,1", '1') + falling_vertex("3,1", "-1,1", '0') +
                      falling_vertex("1,4", "0,1", '1') +
                      falling_vertex("6755399441055745,9007199254740992", "-1,1", '0'));
    folder_.write("hard/edge-edge/a.csv", falling_edge("0,1", '1') + falling_edge("2,1", '0'));
  }
  std::string set() const { return folder_.file("hard"); }

  static Json measure(const std::string& arguments) {
    const Outcome outcome = run("accuracy --rounds 1 --json - " + arguments, "2>/dev/null");
    EXPECT_EQ(outcome.code, kExitOk);
    return Json::parse(outcome.out);
  }
  static void expect_promises(const Json& row) {
    if (row["positions"] != "float64" || row["tier"] == "fast") return;
    EXPECT_EQ(row["false_negatives"], 0) << row;
    EXPECT_EQ(row["late"], 0) << row;
    if (row["tier"] != "exact") return;
    EXPECT_EQ(row["false_positives"], 0) << row;
    EXPECT_EQ(row["possible"], 0) << row;
    EXPECT_EQ(row["toi_error_max"], 0) << row;
  }
  TemporaryFolder folder_;
};

TEST_F(CliAccuracy, QuerySetsUnderEverySetting) {
  const Json rows = measure(set());
  ASSERT_EQ(rows.size(), 16U);  // (fast, six tolerances, exact) in both precisions
  for (const Json& row : rows) {
    EXPECT_THAT(keys(row),
                ElementsAre("set", "kind", "tier", "tolerance", "positions", "bounds", "queries", "contacts",
                            "false_positives", "false_negatives", "possible", "toi_error_max",
                            "toi_error_mean", "late", "ns_per_query", "ns_p99", "ns_max", "ms_per_frame"));
    EXPECT_EQ(row["set"], "hard");
    EXPECT_EQ(row["kind"], "queries");
    EXPECT_EQ(row["queries"], 6);
    EXPECT_EQ(row["contacts"], 3);
    EXPECT_EQ(row["tolerance"].is_null(), row["tier"] != "certified");
    EXPECT_TRUE(row["bounds"].is_null() && row["ms_per_frame"].is_null());
    EXPECT_GT(row["ns_per_query"], 0);
    expect_promises(row);
    // An effect of float32: a false contact.
    if (row["tier"] == "exact" && row["positions"] == "float32") {
      EXPECT_EQ(row["false_positives"], 1);
    }
  }
}

// The exact tier says what is within the separation: more than touches, and no setting may miss it.
TEST_F(CliAccuracy, WithASeparation) {
  const Json touching =
      measure(std::string(kMeasuredScene) + " --bounds kdop18 --tiers exact --positions float64");
  for (const std::string& input : {set(), std::string(kMeasuredScene) + " --bounds kdop18"}) {
    const Json rows = measure(input + " --min-separation 0.05 --positions float64");
    ASSERT_EQ(rows.size(), 7U) << "six tolerances and exact: fast tests touching";
    for (const Json& row : rows) {
      EXPECT_NE(std::string(row["set"]).find(", separation 0.05"), std::string::npos);
      EXPECT_NE(row["tier"], "fast");
      expect_promises(row);
    }
    if (rows[0]["kind"] == "scene") {
      EXPECT_GT(rows.back()["contacts"], touching[0]["contacts"]);
    }
  }
  EXPECT_EQ(run("accuracy --tiers fast --min-separation 0.05 " + set()).code, kExitUsage);
}

TEST_F(CliAccuracy, ScenesUnderEverySetting) {
  const Json rows = measure(std::string(kMeasuredScene) + " --substeps 2 --tolerances 1e-3,1e-6");
  ASSERT_EQ(rows.size(), 16U);  // (fast, two tolerances, exact), both precisions, both bounds
  for (const Json& row : rows) {
    EXPECT_EQ(row["kind"], "scene");
    EXPECT_GT(row["contacts"], 0);
    EXPECT_GT(row["queries"], row["contacts"]);
    EXPECT_GT(row["ms_per_frame"], 0);
    EXPECT_GT(row["ns_per_query"], 0);
    EXPECT_TRUE(row["ns_p99"].is_null());
    expect_promises(row);
    // Bounds change the cost, never the answer.
    const auto same = std::ranges::count_if(rows, [&](const Json& other) {
      return std::ranges::all_of(
          std::initializer_list<const char*>{"tier", "tolerance", "positions", "false_positives",
                                             "false_negatives", "possible", "toi_error_mean"},
          [&](const char* key) { return other[key] == row[key]; });
    });
    EXPECT_EQ(same, 2) << row;
  }
}

TEST_F(CliAccuracy, TableCsvAndPlots) {
  const Outcome outcome = run("accuracy --rounds 1 --tolerances 1e-6 " + set() + " " + kMeasuredScene +
                              " --csv " + folder_.file("trade.csv") + " --svg " + folder_.file("plots/here"));
  ASSERT_EQ(outcome.code, kExitOk) << outcome.out;
  EXPECT_THAT(outcome.out, HasSubstr("hard: 6 queries, 3 contacts in truth"));
  EXPECT_THAT(outcome.out, HasSubstr("| certified 1e-06 | float32 "));
  EXPECT_THAT(outcome.out, HasSubstr("ms a frame"));
  std::istringstream csv(folder_.read("trade.csv"));
  std::string line;
  std::getline(csv, line);
  EXPECT_EQ(
      line,
      "set,kind,tier,tolerance,positions,bounds,queries,contacts,false_positives,false_negatives,possible,"
      "toi_error_max,toi_error_mean,late,ns_per_query,ns_p99,ns_max,ms_per_frame");
  std::getline(csv, line);
  EXPECT_THAT(line, ::testing::StartsWith("hard,queries,fast,,float64,,6,3,"));
  for (const char* name : {"plots/here/hard-queries.svg", "plots/here/bart-triangles-1000-scene.svg"}) {
    const std::string svg = folder_.read(name);
    EXPECT_THAT(svg, ::testing::StartsWith("<svg ")) << name;
    EXPECT_THAT(svg, ::testing::EndsWith("</svg>\n")) << name;
    for (const char* part : {"prefers-color-scheme:dark", ">fast<", ">exact<", ">1e-06<", "false positives"})
      EXPECT_THAT(svg, HasSubstr(part)) << name;
    EXPECT_THAT(svg, ::testing::Not(HasSubstr("nan"))) << name;
    EXPECT_LT(svg.size(), 40'000U);
  }
}

// One face and a vertex that falls through it, so that all other pairs are apart.
TEST_F(CliAccuracy, AFoldersTruthChecksTheExactTier) {
  const auto mesh = [](double z) {
    return format_ply({std::vector<double>{0, 0, 0, 1, 0, 0, 0, 1, 0, 0.25, 0.25, z, 5, 5, z, 6, 5, z},
                       {{0, 1, 2}, {3, 4, 5}}},
                      "");
  };
  std::filesystem::create_directories(folder_.file("step"));
  folder_.write("step/t0.ply", mesh(1));
  folder_.write("step/t1.ply", mesh(-1));
  const std::string header = "type,v0,v1,v2,v3,collides\n";
  const std::string measure = "accuracy --rounds 1 " + folder_.file("step");
  folder_.write("step/truth.csv", header + "vf,3,2,0,1,1\nvf,4,0,1,2,0\n");
  const Outcome right = run(measure);
  EXPECT_EQ(right.code, kExitOk) << right.out;
  EXPECT_THAT(right.out,
              HasSubstr("truth.csv: 1 contact; of tier exact's contacts 0 are missing, 0 are known"));
  folder_.write("step/truth.csv", header + "vf,4,0,1,2,1\n");
  EXPECT_EQ(run(measure).code, kExitNo);
  folder_.write("step/truth.csv", header + "vf,3,0,1,2,0\n");
  EXPECT_EQ(run(measure).code, kExitNo);
  folder_.write("step/truth.csv", header + "vf,3,0,1,2\n");
  const Outcome broken = run(measure);
  EXPECT_EQ(broken.code, kExitFailed);
  EXPECT_THAT(broken.out, HasSubstr("truth.csv: line 2"));
}

TEST_F(CliAccuracy, MisuseAndFailures) {
  for (const char* arguments : {"--tiers sharp", "--tolerances 0", "--tolerances x", "--positions float16",
                                "--bounds ball", "--rounds 0", "--type xy"}) {
    const Outcome outcome = run("accuracy " + set() + " " + arguments);
    EXPECT_EQ(outcome.code, kExitUsage) << arguments << ": " << outcome.out;
    EXPECT_EQ(std::count(outcome.out.begin(), outcome.out.end(), '\n'), 1) << outcome.out;
  }
  EXPECT_EQ(run("accuracy").code, kExitUsage);
  EXPECT_EQ(run("accuracy " + folder_.file("none")).code, kExitFailed);
  const Outcome spaced = run("accuracy " + set() + " --tiers exact certified");
  EXPECT_EQ(spaced.code, kExitFailed);
  EXPECT_EQ(spaced.out,
            "warmfront: certified: no such file or folder; a list is given with commas, as in one,two\n")
      << "before anything is measured";
  const Outcome table =
      run("accuracy --rounds 1 --tiers exact --positions float64 --csv - " + set(), "2>/dev/null");
  EXPECT_EQ(table.code, kExitOk);
  EXPECT_EQ(std::count(table.out.begin(), table.out.end(), '\n'), 2) << table.out;
  EXPECT_EQ(run("accuracy builtin:nothing").code, kExitUsage) << "as detect";
  EXPECT_EQ(run("accuracy --rounds 1 " + set() + " --csv " + folder_.file("no/t.csv")).code, kExitFailed);
  EXPECT_EQ(run("accuracy --rounds 1 " + set() + " --svg " + folder_.write("file", "") + "/x").code,
            kExitFailed);
}

}  // namespace
}  // namespace warmfront::client

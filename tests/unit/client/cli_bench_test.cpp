// SPDX-License-Identifier: Apache-2.0
// `warmfront bench` from outside: equal answers under every setting, and the documented fields. Times are not
// checked.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <sstream>

#include "client/cli/exit_codes.h"
#include "client/io/ply.h"
#include "tests/unit/client/command.h"
#include "tests/unit/client/temporary_folder.h"

namespace warmfront::client {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::StartsWith;
using Json = nlohmann::ordered_json;

constexpr const char* kBenchScene =
    "'builtin:bart?triangles=1000' --frames 0:4 --rounds 2 --threads-list 1,2";

class CliBench : public ::testing::Test {
 protected:
  static Json measure(const std::string& arguments) {
    const Outcome outcome =
        run(std::string("bench --json - ") + kBenchScene + " " + arguments, "2>/dev/null");
    EXPECT_EQ(outcome.code, kExitOk);
    return Json::parse(outcome.out);
  }
  static const Json& setting(const Json& report, const std::string& name) {
    const Json& all = report["inputs"][0]["settings"];
    const auto found = std::ranges::find_if(all, [&](const Json& row) { return row["setting"] == name; });
    EXPECT_NE(found, all.end()) << name;
    return *found;
  }
  TemporaryFolder folder_;
};

TEST_F(CliBench, EverySettingHasItsFieldsAndOneAnswer) {
  const Json report = measure("");
  EXPECT_THAT(keys(report), ElementsAre("machine", "build", "rounds", "inputs"));
  EXPECT_THAT(keys(report["machine"]), ElementsAre("cpu", "cores", "memory_bytes"));
  EXPECT_THAT(keys(report["build"]),
              ElementsAre("version", "revision", "compiler", "type", "flags", "instructions"));
  EXPECT_EQ(report["rounds"], 2);
  ASSERT_EQ(report["inputs"].size(), 1U);
  const Json& input = report["inputs"][0];
  EXPECT_THAT(keys(input), ElementsAre("input", "triangles", "vertices", "steps", "substeps",
                                       "peak_rss_bytes", "agree", "settings"));
  EXPECT_EQ(input["input"], "bart?triangles=1000");
  EXPECT_EQ(input["steps"], 4);
  EXPECT_EQ(input["agree"], true);
  EXPECT_GT(input["peak_rss_bytes"], 1'000'000);

  std::vector<std::string> names;
  for (const Json& row : input["settings"]) {
    names.push_back(row["setting"]);
    EXPECT_THAT(keys(row),
                ElementsAre("setting", "threads", "tier", "tolerance", "min_separation", "report", "front",
                            "lazy", "bounds", "normal_cones", "leaf_size", "hash", "ms", "counts", "bytes"));
    EXPECT_THAT(keys(row["ms"]),
                ElementsAre("create", "cold", "step", "total", "refit", "front", "elementary", "adjacent"));
    for (const auto& stage : row["ms"].items()) {
      EXPECT_THAT(keys(stage.value()), ElementsAre("median", "min", "max"));
      EXPECT_LE(stage.value()["min"], stage.value()["median"]) << stage.key();
      EXPECT_LE(stage.value()["median"], stage.value()["max"]) << stage.key();
    }
    EXPECT_LE(row["ms"]["total"]["min"], row["ms"]["step"]["max"]);
    EXPECT_THAT(
        keys(row["counts"]),
        ElementsAre("contacts", "bv_tests", "primitive_tests", "front_pairs", "front_skipped",
                    "front_sprouted", "front_pruned", "triangle_pairs", "adjacent_pairs", "cone_culled_pairs",
                    "orphan_tests", "elementary_tests", "coplanarity_passed", "exact_tests"));
    EXPECT_THAT(keys(row["bytes"]), ElementsAre("touched", "front", "front_per_triangle", "session"));
    EXPECT_GT(row["counts"]["contacts"], 0);
    EXPECT_GT(row["bytes"]["touched"], 0);
    if (row["tier"] == "certified") {
      EXPECT_EQ(row["hash"], input["settings"][0]["hash"]) << names.back();
    }
  }
  EXPECT_THAT(names, ElementsAre("default", "default", "front none", "front paper", "front warm", "cones on",
                                 "bounds aabb", "nothing found", "parts not separated", "leaf 1", "leaf 2",
                                 "leaf 4", "leaf 8", "leaf 16", "leaf 32", "tier fast", "tier exact"));
}

TEST_F(CliBench, SettingsChangeWhatTheyName) {
  const Json report = measure("--ablations front,leaf");
  const Json& all = report["inputs"][0]["settings"];
  EXPECT_EQ(all.size(), 11U);
  EXPECT_EQ(all[0]["threads"], 1);
  EXPECT_EQ(all[1]["threads"], 2);
  EXPECT_EQ(all[0]["counts"], all[1]["counts"]);
  EXPECT_EQ(setting(report, "front none")["counts"]["front_pairs"], 0);
  EXPECT_EQ(setting(report, "front none")["bytes"]["front"], 0);
  EXPECT_GT(all[0]["bytes"]["front_per_triangle"], 0);
  EXPECT_GT(all[0]["counts"]["front_skipped"], 0);
  EXPECT_EQ(setting(report, "front warm")["counts"]["front_skipped"], 0);
  EXPECT_EQ(setting(report, "leaf 1")["counts"]["primitive_tests"], 0);
  EXPECT_EQ(setting(report, "leaf 1")["counts"]["triangle_pairs"], all[0]["counts"]["triangle_pairs"]);
}

TEST_F(CliBench, TheAnswerIsThatOfDetect) {
  for (const std::string options :
       {"--min-separation 0.01", "--report earliest --tier exact", "--substeps 3 --tolerance 1e-3"}) {
    const Json report = measure("--ablations none " + options);
    const Outcome detected =
        run("detect --json - 'builtin:bart?triangles=1000' --frames 0:4 " + options, "2>/dev/null");
    ASSERT_EQ(detected.code, kExitOk);
    for (const Json& row : report["inputs"][0]["settings"])
      EXPECT_EQ(row["hash"], Json::parse(detected.out)["contacts_hash"]) << options;
  }
  // The fast tier knows of no separations.
  const Json separated = measure("--ablations tier --min-separation 0.01");
  EXPECT_EQ(separated["inputs"][0]["settings"].size(), 3U);
}

// Then the cold step is all there is.
TEST_F(CliBench, AnInputOfOneStep) {
  for (const char* name : {"t0.ply", "t1.ply"}) {
    const double z = name[1] == '0' ? 1 : -1;
    folder_.write(name,
                  format_ply({std::vector<double>{0, 0, 0, 1, 0, 0, 0, 1, 0, 0.25, 0.25, z, 5, 5, z, 6, 5, z},
                              {{0, 1, 2}, {3, 4, 5}}},
                             ""));
  }
  // The files by name are the frames of one scene, as in detect.
  for (const std::string& named : {folder_.file(""), folder_.file("t0.ply") + " " + folder_.file("t1.ply")}) {
    const Outcome outcome = run("bench --rounds 1 --json - " + named, "2>/dev/null");
    ASSERT_EQ(outcome.code, kExitOk) << outcome.out;
    ASSERT_EQ(Json::parse(outcome.out)["inputs"].size(), 1U) << named;
    const Json input = Json::parse(outcome.out)["inputs"][0];
    EXPECT_EQ(input["steps"], 1);
    for (const Json& row : input["settings"]) {
      EXPECT_EQ(row["counts"]["contacts"], 3);  // the vertex, and its two edges with the hypotenuse
      EXPECT_EQ(row["ms"]["cold"], row["ms"]["step"]);
    }
  }
  EXPECT_THAT(run("bench " + folder_.file("t0.ply")).out, HasSubstr("is one frame"));
}

TEST_F(CliBench, TablesAndCsv) {
  const Outcome outcome =
      run(std::string("bench ") + kBenchScene +
          " 'builtin:bart?triangles=1001' --ablations front,tier --csv " + folder_.file("bench.csv"));
  ASSERT_EQ(outcome.code, kExitOk) << outcome.out;
  EXPECT_THAT(outcome.out, StartsWith("machine: "));
  for (const char* part :
       {"\nbuild: warmfront ", "bart?triangles=1000: ", "bart?triangles=1001: ", "| ms a frame ",
        "| counts a frame ", "| updating BVH | running time | the paper's |", " 60.55% |",
        "saved against front none:\n  default: ", "times its elementary tests", "peak memory"})
    EXPECT_THAT(outcome.out, HasSubstr(part));
  EXPECT_THAT(outcome.out, ::testing::Not(HasSubstr("nan")));
  std::istringstream csv(folder_.read("bench.csv"));
  std::string line;
  std::getline(csv, line);
  EXPECT_THAT(line,
              StartsWith("input,triangles,vertices,steps,substeps,peak_rss_bytes,agree,setting,threads,tier,"
                         "tolerance,min_separation,report,front,lazy,bounds,normal_cones,leaf_size,hash,"
                         "ms_create_median,ms_create_min,ms_create_max,ms_cold_median,"));
  EXPECT_THAT(line, HasSubstr(",counts_bv_tests,"));
  EXPECT_THAT(line, ::testing::EndsWith(",bytes_session,rounds,cpu,revision"));
  const auto columns = std::count(line.begin(), line.end(), ',');
  int lines = 0;
  for (; std::getline(csv, line); ++lines) EXPECT_GE(std::count(line.begin(), line.end(), ','), columns);
  EXPECT_EQ(lines, 2 * 7);
}

TEST_F(CliBench, MisuseAndFailures) {
  for (const char* arguments :
       {"--tier sharp", "--tolerance 0", "--report count", "--rounds 0", "--threads-list 0",
        "--threads-list 1,x", "--ablations cold", "--ablations none,front", "--substeps 0", "--frames 3:2",
        "--frames 0:99", "--min-separation -1", "--tier fast --min-separation 1"}) {
    const Outcome outcome =
        run(std::string("bench 'builtin:bart?triangles=1000&frames=5' --json - ") + arguments);
    EXPECT_EQ(outcome.code, kExitUsage) << arguments << ": " << outcome.out;
    EXPECT_EQ(std::count(outcome.out.begin(), outcome.out.end(), '\n'), 1) << outcome.out;
  }
  EXPECT_EQ(run("bench").code, kExitUsage);
  EXPECT_EQ(run("bench " + folder_.file("none")).code, kExitFailed);
  const Outcome spaced = run(std::string("bench ") + kBenchScene + " --ablations front cones");
  EXPECT_EQ(spaced.code, kExitFailed);
  EXPECT_EQ(spaced.out,
            "warmfront: cones: no such file or folder; a list is given with commas, as in one,two\n")
      << "before anything is measured";
  EXPECT_EQ(run(std::string("bench ") + kBenchScene + " --csv - --json -").code, kExitUsage);
  EXPECT_EQ(run("bench builtin:nothing").code, kExitUsage) << "as detect";
  EXPECT_EQ(
      run(std::string("bench ") + kBenchScene + " --ablations none --csv " + folder_.file("no/b.csv")).code,
      kExitFailed);
}

}  // namespace
}  // namespace warmfront::client

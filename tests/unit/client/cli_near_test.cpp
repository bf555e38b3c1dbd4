// SPDX-License-Identifier: Apache-2.0
// The verb `near`: the same pairs in this process and behind a daemon, as files tell them, and its misuse.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <sstream>
#include <string>

#include "client/cli/exit_codes.h"
#include "tests/unit/client/cli_fixture.h"
#include "tests/unit/client/command.h"
#include "tests/unit/client/temporary_folder.h"
#include "tests/unit/server/local_daemon.h"

namespace warmfront::client {
namespace {

using Json = nlohmann::ordered_json;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

Json report(const std::string& arguments) {
  const Outcome outcome = run(std::string("near ") + kNearScene + " --json - " + arguments, "2>/dev/null");
  EXPECT_EQ(outcome.code, kExitOk) << outcome.out;
  return Json::parse(outcome.out);
}

TEST(CliNear, HasTheSameAnswersInThisProcessAndBehindADaemon) {
  test::LocalDaemon daemon;
  for (const char* how : {"--distance 0.05", "--distance 0.02 --of-diagonal --tier exact", "--distance 0"}) {
    const Json here = report(how), there = report(std::string(how) + " --server " + daemon.address());
    EXPECT_EQ(here["contacts_hash"], there["contacts_hash"]) << how;
    ASSERT_EQ(here["frames"].size(), 9U);
    for (std::size_t k = 0; k < 9; ++k)
      for (const char* what : {"frame", "vf", "ee", "vh", "possible", "least_distance"})
        EXPECT_EQ(here["frames"][k][what], there["frames"][k][what]) << how;
  }
}

TEST(CliNear, JsonHasTheFieldsThatToolsRead) {
  const Json json = report("--distance 0.05");
  EXPECT_THAT(keys(json),
              ElementsAre("tier", "distance", "contacts_hash", "filters", "most_thickness", "frames"));
  EXPECT_THAT(keys(json["frames"][0]), ElementsAre("frame", "vf", "ee", "vh", "possible", "least_distance", "ms"));
  const Json counted = report("--distance 0.05 --count");
  EXPECT_THAT(keys(counted), ElementsAre("tier", "distance", "filters", "most_thickness", "frames"));
  for (std::size_t k = 0; k < 9; ++k) EXPECT_EQ(json["frames"][k]["vf"], counted["frames"][k]["vf"]);
}

TEST(CliNear, ListsEachClosestPairOnce) {
  test::LocalDaemon daemon;
  const TemporaryFolder folder;
  const Json all = report("--distance 0.05"), here = report("--distance 0.05 --reduced"),
             there = report("--distance 0.05 --reduced --server " + daemon.address());
  EXPECT_EQ(here["contacts_hash"], there["contacts_hash"]);
  EXPECT_NE(here["contacts_hash"], all["contacts_hash"]);
  EXPECT_THAT(keys(here["frames"][0]),
              ElementsAre("frame", "vf", "ee", "vh", "possible", "rows", "least_distance", "ms"));
  std::uint64_t rows = 0;
  for (std::size_t k = 0; k < 9; ++k) {
    for (const char* what : {"vf", "ee", "vh", "possible", "least_distance"})
      EXPECT_EQ(here["frames"][k][what], all["frames"][k][what]);
    EXPECT_EQ(here["frames"][k]["rows"], there["frames"][k]["rows"]);
    rows += here["frames"][k]["rows"].get<std::uint64_t>();
  }
  EXPECT_GT(rows, 0U);
  std::uint64_t pairs = 0, listed = 0;
  for (const Json& frame : all["frames"])
    pairs += frame["vf"].get<std::uint64_t>() + frame["ee"].get<std::uint64_t>();
  EXPECT_LT(rows, pairs);

  const auto written = [&](const std::string& name) {
    const Outcome outcome =
        run(std::string("near ") + kNearScene + " --distance 0.05 --reduced --fields closest --contacts " +
            folder.file(name));
    EXPECT_EQ(outcome.code, kExitOk) << outcome.out;
    EXPECT_THAT(outcome.out, HasSubstr("rows"));
    return folder.read(name);
  };
  std::istringstream lines(written("near.csv"));
  std::string line;
  std::getline(lines, line);
  EXPECT_EQ(line, "frame,type,v0,v1,v2,v3,toi,status,closest,multiplicity,stencil");
  std::uint64_t multiplicities = 0;
  while (std::getline(lines, line)) {
    const std::size_t last = line.rfind(','), before = line.rfind(',', last - 1);
    multiplicities += std::stoull(line.substr(before + 1, last - before - 1));
    ++listed;
  }
  EXPECT_EQ(listed, rows);
  EXPECT_EQ(multiplicities, pairs);
  EXPECT_THAT(written("near.jsonl"), HasSubstr(",\"multiplicity\":1,\"stencil\":15}"));
  run(std::string("near ") + kNearScene + " --distance 0.05 --reduced --contacts " + folder.file("near.vtp"));
  EXPECT_THAT(folder.read("near_000001.vtp"), HasSubstr("Name=\"multiplicity\""));
  EXPECT_EQ(run(std::string("near ") + kNearScene + " --distance 0.05 --reduced --count", "2>&1").code,
            kExitUsage);
}

TEST(CliNear, LeavesOutWhatItsFiltersSay) {
  test::LocalDaemon daemon;
  const TemporaryFolder folder;
  folder.write("pairs.csv", "0,1\n2 , 3\r\n\n0,40\n");
  std::string patches;
  for (int v = 0; v < 539; ++v) patches += "7\n";
  folder.write("patches.txt", patches);
  const auto near = [&](const std::string& filters, const std::string& where) {
    const Json json = report("--distance 0.2 " + filters + where);
    std::uint64_t pairs = 0;
    for (const Json& frame : json["frames"])
      pairs += frame["vf"].get<std::uint64_t>() + frame["ee"].get<std::uint64_t>();
    return std::pair(pairs, json["contacts_hash"].get<std::string>());
  };
  const auto all = near("", "");
  for (const std::string& filters :
       {std::string("--filter-edges 2 "), std::string("--filter-near-at-rest 0.1 "),
        "--filter-pairs " + folder.file("pairs.csv") + " ",
        "--filter-patches " + folder.file("patches.txt") + " "}) {
    const auto here = near(filters, "");
    EXPECT_LT(here.first, all.first) << filters;
    EXPECT_EQ(here, near(filters, "--server " + daemon.address())) << filters;
  }
  EXPECT_EQ(near("--filter-patches " + folder.file("patches.txt"), "").first, 0U) << "all is one patch";

  // What an input's info.json says holds where no option says otherwise.
  const std::string scene = folder.file("scene");
  ASSERT_EQ(run("scene 'cloth-ball?triangles=1000&frames=3' --out " + scene, "2>&1").code, kExitOk);
  const auto counts = [&](const std::string& options) {
    const Outcome outcome =
        run("near " + scene + " --distance 0.2 --json - --count " + options, "2>/dev/null");
    EXPECT_EQ(outcome.code, kExitOk) << outcome.out;
    Json told = Json::parse(outcome.out);
    for (Json& frame : told["frames"]) frame.erase("ms");
    return told;
  };
  const Json with = counts("--filter-edges 1 --filter-near-at-rest 0.07"), without = counts("");
  EXPECT_NE(with["frames"], without["frames"]);
  EXPECT_EQ(
      with["filters"],
      Json({{"within_edges", 1}, {"near_at_rest", 0.07}, {"excluded_vertex_pairs", 0}, {"patches", false}}));
  EXPECT_EQ(without["filters"]["within_edges"], 0);
  EXPECT_EQ(without["most_thickness"], 0);
  Json info = Json::parse(folder.read("scene/info.json"));
  info["filters"] = {{"within_edges", 1}, {"near_at_rest", 0.07}};
  folder.write("scene/info.json", info.dump());
  EXPECT_EQ(counts(""), with);
  EXPECT_EQ(counts("--server " + daemon.address()), with);
  EXPECT_EQ(counts("--filter-edges 0 --filter-near-at-rest 0"), without);

  // So does the thickness of its bodies, with any --bodies.
  info.erase("filters");
  for (Json& body : info["bodies"]) body["thickness"] = 0.05;
  folder.write("scene/info.json", info.dump());
  const Json thick = counts("--bodies components");
  EXPECT_NE(thick["frames"], without["frames"]);
  EXPECT_EQ(thick["most_thickness"], 0.05);
  EXPECT_EQ(counts("--bodies deformable"), thick);
  info["bodies"][0]["vertex_count"] = 1 << 30;
  folder.write("scene/info.json", info.dump());
  const Outcome beyond =
      run("near " + scene + " --distance 0.2 --bodies deformable --html " + folder.file("p.html"), "2>&1");
  EXPECT_EQ(beyond.code, kExitFailed) << beyond.out;
  EXPECT_THAT(beyond.out, HasSubstr("vertex_count"));

  const auto misuse = [&](const std::string& filters) {
    return run(std::string("near ") + kNearScene + " --distance 0.2 " + filters, "2>&1");
  };
  EXPECT_EQ(misuse("--filter-edges 4").code, kExitUsage);
  EXPECT_EQ(misuse("--filter-near-at-rest -1").code, kExitUsage);
  folder.write("bad.txt", "0,1\n5\n");
  EXPECT_THAT(misuse("--filter-pairs " + folder.file("bad.txt")).out,
              HasSubstr("bad.txt: line 2: '5' is no pair"));
  EXPECT_THAT(misuse("--filter-patches " + folder.file("bad.txt")).out, HasSubstr("bad.txt: line 1"));
  folder.write("short.txt", "1\n2\n");
  EXPECT_THAT(misuse("--filter-patches " + folder.file("short.txt")).out,
              HasSubstr("short.txt: 2 lines, but the scene has 539 vertices"));
  folder.write("far.txt", "0,539\n");
  EXPECT_THAT(misuse("--filter-pairs " + folder.file("far.txt")).out,
              HasSubstr("filters.excluded_vertex_pairs[0]: vertex 539 is not in [0, 539)"));
}

TEST(CliNear, WritesHowFarEachVertexIsFromAnything) {
  test::LocalDaemon daemon;
  const TemporaryFolder folder;
  const auto written = [&](const std::string& name, const std::string& arguments) {
    const Outcome outcome = run(std::string("near ") + kNearScene + " --distance 0.05 --frames 4:6 --count " +
                                arguments + " --vertex-distances " + folder.file(name));
    EXPECT_EQ(outcome.code, kExitOk) << outcome.out;
    return folder.read(name);
  };
  const std::string here = written("here.csv", "");
  EXPECT_EQ(here, written("there.csv", "--server " + daemon.address()));
  std::istringstream lines(here);
  std::string line;
  std::getline(lines, line);
  EXPECT_EQ(line, "frame,vertex,distance");
  int near = 0, far = 0;
  while (std::getline(lines, line)) {
    const double distance = std::stod(line.substr(line.rfind(',') + 1));
    EXPECT_TRUE(distance >= 0 && distance <= 0.05) << line;
    ++(distance < 0.05 ? near : far);
  }
  EXPECT_GT(near, 100);
  EXPECT_GT(far, 100);
  const Outcome twice =
      run(std::string("near ") + kNearScene + " --distance 0.05 --json - --vertex-distances -", "2>&1");
  EXPECT_EQ(twice.code, kExitUsage) << twice.out;
}

TEST(CliNear, ListsThePairsWithTheirDistances) {
  const TemporaryFolder folder;
  const Outcome outcome =
      run(std::string("near ") + kNearScene + " --distance 0.05 --frames 4:8 --contacts " +
          folder.file("c.csv") + " --fields squared_distance,closest --json " + folder.file("c.json"));
  ASSERT_EQ(outcome.code, kExitOk) << outcome.out;
  std::istringstream lines(folder.read("c.csv"));
  std::string line;
  std::getline(lines, line);
  EXPECT_EQ(line, "frame,type,v0,v1,v2,v3,toi,status,squared_distance,closest");
  std::uint64_t rows = 0;
  while (std::getline(lines, line)) {
    ++rows;
    const std::size_t last = line.rfind(','), before = line.rfind(',', last - 1);
    EXPECT_LE(std::sqrt(std::stod(line.substr(before + 1))), 0.05 * (1 + 1e-5));
    EXPECT_THAT((std::array{"vv", "ev", "ee", "fv"}), ::testing::Contains(line.substr(last + 1)));
  }
  std::uint64_t told = 0;
  const Json json = Json::parse(folder.read("c.json"));
  for (const Json& frame : json["frames"])
    told += frame["vf"].get<std::uint64_t>() + frame["ee"].get<std::uint64_t>();
  EXPECT_EQ(json["frames"].size(), 5U);
  EXPECT_EQ(rows, told);
  EXPECT_GT(rows, 0U);
}

/// Without what a run takes.
std::string page_of(const std::string& command) {
  const Outcome outcome = run(command + " --html -", "2>/dev/null");
  EXPECT_THAT(outcome.out, ::testing::StartsWith("<!doctype html>")) << command;
  EXPECT_THAT(outcome.out, ::testing::EndsWith("</html>\n")) << command;
  const std::size_t ms = outcome.out.find("\"ms\":{\"total\":[");
  EXPECT_NE(ms, std::string::npos) << command;
  return std::string(outcome.out).erase(ms, outcome.out.find(']', ms) - ms);
}

TEST(CliNear, WritesTheSamePageInThisProcessAndBehindADaemon) {
  test::LocalDaemon daemon;
  const std::string scene = kNearScene;
  for (const std::string& command :
       {"near " + scene + " --distance 0.05", "near " + scene + " --distance 0.05 --reduced",
        "near " + scene + " --distance 0.02 --of-diagonal --tier exact", "tangled " + scene}) {
    const std::string here = page_of(command);
    EXPECT_EQ(here, page_of(command + " --server " + daemon.address()));
    EXPECT_THAT(here, HasSubstr(command.starts_with("tangled") ? R"("asked":"tangled")" : R"("distance":)"));
  }
}

TEST(CliNear, TakesOneMesh) {
  const TemporaryFolder folder;
  ASSERT_EQ(run(std::string("scene cloth-ball --triangles 1000 --frames 2 --out ") + folder.file("s")).code,
            kExitOk);
  const Outcome outcome = run("near " + folder.file("s/mesh.ply") + " --distance 0.05");
  EXPECT_EQ(outcome.code, kExitOk) << outcome.out;
  EXPECT_THAT(outcome.out, HasSubstr("1 frame, "));
}

TEST(CliNear, UsageErrorsTakeOneLine) {
  for (const char* wrong :
       {"", "--distance -1", "--distance nan", "--distance 1 --tier fast", "--distance 1 --fields closest",
        "--distance 1 --count --contacts c.csv", "--distance 1 --contacts c.txt",
        "--distance 1 --contacts - --json -", "--distance 1 --count --html p.html",
        "--distance 1 --html - --json -", "--distance 1 --html-limit 1MiB",
        "--distance 1 --threads 2 --server unix:/tmp/none"}) {
    const Outcome outcome = run(std::string("near ") + kNearScene + " " + wrong);
    EXPECT_EQ(outcome.code, kExitUsage) << wrong << outcome.out;
    EXPECT_THAT(outcome.out, HasSubstr("warmfront: ")) << wrong;
  }
  EXPECT_EQ(run("near /nonexistent --distance 1").code, kExitFailed);
}

}  // namespace
}  // namespace warmfront::client

// SPDX-License-Identifier: Apache-2.0
// `warmfront detect` as others use it: the real binary, its JSON and CSV to the letter.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "client/cli/exit_codes.h"
#include "tests/unit/client/cli_fixture.h"
#include "tests/unit/client/command.h"
#include "tests/unit/client/temporary_folder.h"

namespace warmfront::client {
namespace {

using ::testing::AnyOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using Json = nlohmann::ordered_json;

// A face that repeats a vertex is tested as a segment; ignored parts of a file are reported.
TEST(Cli, SegmentsAndPointsAreMet) {
  const TemporaryFolder folder;
  const auto frame = [&](const char* name, const char* z) {
    return folder.write(name, std::string("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 9 9 9\nf 1 2 3\nv 0.2 0.2 ") + z +
                                  "\nv 0.3 0.2 " + z + "\nf 5 5 6\nl 5 6\n");
  };
  const std::string input = frame("t0.obj", "1") + " " + frame("t1.obj", "-1");
  const Outcome segment = run("detect " + input + " --json -", "2>/dev/null");
  ASSERT_EQ(segment.code, kExitOk);
  const Json frames = Json::parse(segment.out)["frames"];
  EXPECT_EQ(frames[0]["vf"], 2) << "both ends of the segment pass the triangle";
  EXPECT_NEAR(frames[0]["earliest_toi"].get<double>(), 0.5, 1e-5);
  EXPECT_THAT(run("detect " + input, "2>/dev/null").out,
              HasSubstr("\n1 step of 2 triangles, 1 edge, 6 vertices: 2 contacts (2 vf"));
  const std::string notes = run("detect " + input + " --json -", "2>&1 >/dev/null").out;
  EXPECT_THAT(notes, HasSubstr("warmfront: note: " + folder.file("t0.obj") +
                               ": vertices in no face and no edge: 1 of 6;"));
  const std::string points =
      folder.write("p0.obj", "v 0 0 0\nv 1 0 0\n") + " " + folder.write("p1.obj", "v 0 0 0\nv 0.1 0 0\n");
  const Json apart = Json::parse(run("detect " + points + " --json -", "2>/dev/null").out);
  EXPECT_EQ(apart["frames"][0]["ee"], 0) << "points touch nothing";
  const Outcome near = run("detect " + points + " --min-separation 0.2 --contacts -", "2>/dev/null");
  EXPECT_THAT(near.out, HasSubstr("\n1,vv,0,0,1,1,"));
}

// Each row of a step is new or kept, and each row of the step before is kept or ended.
TEST(Cli, ContactsSayWhetherTheyWereThereBefore) {
  const TemporaryFolder folder;
  const auto rows_of = [&](const std::string& options, const std::string& frames = "2:9") {
    EXPECT_EQ(run(std::string("detect ") + kScene + " --frames " + frames + " " + options + " --contacts " +
                  folder.file("c.csv"))
                  .code,
              kExitOk);
    std::istringstream lines(folder.read("c.csv"));
    std::map<int, std::map<std::string, std::set<std::string>>> rows;  // by frame and continuity
    std::string line;
    std::getline(lines, line);
    EXPECT_THAT(line, ::testing::EndsWith(",toi,status,continuity"));
    while (std::getline(lines, line)) {
      const std::size_t features = line.find(',') + 1;
      std::size_t end = features;
      for (int k = 0; k < 5; ++k) end = line.find(',', end) + 1;
      rows[std::stoi(line)][line.substr(line.rfind(',') + 1)].insert(line.substr(features, end - features));
    }
    return rows;
  };
  auto told = rows_of("--ended --min-separation 0.05");
  const auto features_in = [](std::map<std::string, std::set<std::string>>& rows) {
    std::set<std::string> now = rows["kept"];
    now.merge(std::set(rows["new"]));
    return now;
  };
  auto earlier = rows_of("--ended --min-separation 0.05", "1:3");
  std::set<std::string> before = features_in(earlier[2]);  // a range is told as in a run from the first frame
  std::size_t kept = 0, ended = 0;
  for (int frame = 3; frame <= 9; ++frame) {
    std::set<std::string> left = told[frame]["kept"];
    kept += left.size();
    ended += told[frame]["ended"].size();
    left.merge(std::set(told[frame]["ended"]));
    EXPECT_EQ(left, before) << frame;
    before = features_in(told[frame]);
    EXPECT_EQ(before.size(), told[frame]["kept"].size() + told[frame]["new"].size()) << frame;
  }
  EXPECT_GT(kept, 10U);
  EXPECT_GT(ended, 10U);
  auto without = rows_of("--continuity --min-separation 0.05");
  for (int frame = 3; frame <= 9; ++frame) {
    EXPECT_EQ(without[frame]["new"], told[frame]["new"]);
    EXPECT_TRUE(without[frame]["ended"].empty());
  }
}

TEST(Cli, ContactsGoToStdoutAsCsvWithNothingElseThere) {
  const TemporaryFolder folder;
  const std::string detect = std::string("detect ") + kScene + " --frames 2:9 --contacts ";
  ASSERT_EQ(run(detect + folder.file("c.csv")).code, kExitOk);
  const Outcome piped = run(detect + "-", "2>/dev/null");
  EXPECT_EQ(piped.code, kExitOk);
  EXPECT_EQ(piped.out, folder.read("c.csv"));
  EXPECT_THAT(piped.out, HasSubstr("\n9,"));
}

TEST(Cli, DetectJsonHasTheFieldsThatToolsRead) {
  const Outcome outcome =
      run(std::string("detect ") + kScene + " --frames 0:3 --json - --threads 2", "2>/dev/null");
  ASSERT_EQ(outcome.code, kExitOk);
  const Json report = Json::parse(outcome.out);
  EXPECT_THAT(keys(report),
              ElementsAre("vertices", "triangles", "edges", "tier", "tolerance", "threads", "front", "bounds",
                          "contacts_hash", "filters", "most_thickness", "range", "frames"));
  EXPECT_EQ(report["tier"], "certified");
  EXPECT_EQ(report["tolerance"], 1e-6);
  EXPECT_EQ(report["threads"], 2);
  EXPECT_EQ(report["front"], "warm");
  EXPECT_EQ(report["bounds"], "auto");
  EXPECT_EQ(report["contacts_hash"].get<std::string>().size(), 16U);
  ASSERT_EQ(report["frames"].size(), 3U);
  std::uint64_t number = 0;
  for (const Json& frame : report["frames"]) {
    EXPECT_EQ(frame["frame"], ++number);
    EXPECT_THAT(keys(frame), ElementsAre("frame", "vf", "ee", "vh", "possible", "earliest_toi", "ms",
                                         "counts", "bounds", "front_state", "frame_bytes"));
    EXPECT_THAT(keys(frame["ms"]), ElementsAre("total", "refit", "front", "elementary", "adjacent"));
    std::vector<std::string> counts = keys(frame["counts"]);
    ASSERT_GE(counts.size(), 6U);
    counts.resize(6);
    EXPECT_THAT(counts, ElementsAre("bv_tests", "front_pairs", "front_bytes", "triangle_pairs",
                                    "elementary_tests", "exact_tests"));
    const bool contacts = frame["vf"].get<int>() + frame["ee"].get<int>() > 0;
    EXPECT_EQ(frame["earliest_toi"].is_number(), contacts);
    EXPECT_EQ(frame["earliest_toi"].is_null(), !contacts);
    EXPECT_THAT(frame["front_state"].get<std::string>(), AnyOf("built", "updated", "rebuilt"));
  }
}

TEST(Cli, TheHashIsTheSameForFrontsBoundsAndThreads) {
  std::vector<std::string> hashes;
  for (const char* flags : {"", "--front none", "--front paper --threads 1", "--bounds aabb", "--leaf-size 1",
                            "--normal-cones off --threads 2"}) {
    const Outcome outcome =
        run(std::string("detect ") + kScene + " --frames 0:8 --json - " + flags, "2>/dev/null");
    ASSERT_EQ(outcome.code, kExitOk) << flags;
    hashes.push_back(Json::parse(outcome.out)["contacts_hash"]);
    EXPECT_EQ(hashes.back(), hashes.front()) << flags;
  }
  const Outcome count =
      run(std::string("detect ") + kScene + " --frames 0:8 --report count --json -", "2>/dev/null");
  EXPECT_EQ(Json::parse(count.out)["contacts_hash"], "") << "no list, no hash";
}

TEST(Cli, TheModelLeavesOutWhatItSaysAndFramesMayCarryWhatMoved) {
  const auto report = [](const std::string& flags) {
    const Outcome outcome =
        run(std::string("detect ") + kScene + " --frames 0:8 --json - " + flags, "2>/dev/null");
    EXPECT_EQ(outcome.code, kExitOk) << flags;
    return Json::parse(outcome.out);
  };
  const Json all = report("");
  const Json moved = report("--send moved");
  const Json deformable = report("--bodies deformable");
  const Json components = report("--bodies components");
  const Json poses = report("--send poses");
  EXPECT_EQ(moved["contacts_hash"], all["contacts_hash"]);
  EXPECT_EQ(components["contacts_hash"], deformable["contacts_hash"]);
  const Json& frame = all["frames"][4];
  EXPECT_LT(moved["frames"][4]["frame_bytes"], frame["frame_bytes"]) << "some bodies are static";
  EXPECT_LT(4 * poses["frames"][4]["frame_bytes"].get<int>(), frame["frame_bytes"].get<int>());
  EXPECT_GT(frame["counts"]["part_pairs_excluded"], 0);
  EXPECT_LT(frame["counts"]["bv_tests"], deformable["frames"][4]["counts"]["bv_tests"]);

  for (const char* flags : {"", "--send moved", "--send poses", "--substeps 3 --send poses"}) {
    const Outcome explained = run(std::string("detect ") + kScene + " --frames 0:8 --explain " + flags);
    EXPECT_EQ(explained.code, kExitOk) << explained.out;
    EXPECT_THAT(explained.out, HasSubstr("; pairs left out: "));
  }
}

TEST(Cli, ContactFieldsAskedForAreWritten) {
  const TemporaryFolder folder;
  const Outcome outcome = run(std::string("detect ") + kScene +
                              " --frames 2:9 --fields normal,points --contacts " + folder.file("c.csv"));
  ASSERT_EQ(outcome.code, kExitOk) << outcome.out;
  std::istringstream csv(folder.read("c.csv"));
  std::string line;
  ASSERT_TRUE(std::getline(csv, line));
  EXPECT_EQ(line, "frame,type,v0,v1,v2,v3,toi,status,nx,ny,nz,ax,ay,az,bx,by,bz");
  int rows = 0;
  for (; std::getline(csv, line); ++rows) EXPECT_EQ(std::count(line.begin(), line.end(), ','), 16);
  EXPECT_GT(rows, 0);
}

TEST(Cli, ContactsFileAgreesWithTheReport) {
  const TemporaryFolder folder;
  const Outcome outcome =
      run(std::string("detect ") + kScene + " --frames 2:9 --json - --contacts " + folder.file("c.csv"),
          "2>/dev/null");
  ASSERT_EQ(outcome.code, kExitOk);
  std::istringstream csv(folder.read("c.csv"));
  std::string line;
  ASSERT_TRUE(std::getline(csv, line));
  EXPECT_EQ(line, "frame,type,v0,v1,v2,v3,toi,status");
  std::map<std::string, int> rows;
  while (std::getline(csv, line)) {
    EXPECT_EQ(std::count(line.begin(), line.end(), ','), 7);
    ++rows[line.substr(0, line.find(',') + 3)];
  }
  int total = 0;
  const Json report = Json::parse(outcome.out);
  for (const Json& frame : report["frames"]) {
    const std::string number = std::to_string(frame["frame"].get<int>());
    EXPECT_EQ(rows[number + ",vf"], frame["vf"]);
    EXPECT_EQ(rows[number + ",ee"], frame["ee"]);
    total += frame["vf"].get<int>() + frame["ee"].get<int>();
  }
  EXPECT_GT(total, 0) << "a scene without contacts shows nothing";
}

TEST(Cli, SubstepsCountAndEndInTheFrames) {
  const std::string detect = std::string("detect ") + kScene + " --json - ";
  const Json split = Json::parse(run(detect + "--frames 1:3 --substeps 4", "2>/dev/null").out);
  ASSERT_EQ(split["frames"].size(), 8U);
  EXPECT_EQ(split["frames"][0]["frame"], 5);
  EXPECT_EQ(split["frames"][7]["frame"], 12);
  const Json once = Json::parse(run(detect + "--frames 1:3 --substeps 1", "2>/dev/null").out);
  EXPECT_EQ(once["frames"][0]["frame"], 2);
  EXPECT_EQ(once["contacts_hash"],
            Json::parse(run(detect + "--frames 1:3", "2>/dev/null").out)["contacts_hash"]);
}

// What is found between two changes of topology is what is found in these frames alone, from files as from
// the built-in scene, in one session and in a session each.
TEST(Cli, DetectFollowsChangesOfTopology) {
  const TemporaryFolder folder;
  const std::string cut = "'builtin:cut?triangles=1200&frames=20'";
  const auto detect = [](const std::string& arguments) {
    const Outcome outcome = run("detect " + arguments + " --json -", "2>/dev/null");
    EXPECT_EQ(outcome.code, kExitOk) << arguments << outcome.out;
    return Json::parse(outcome.out);
  };
  ASSERT_EQ(run("scene cut --triangles 1200 --frames 20 --out " + folder.file("m")).code, kExitOk);
  std::vector<std::string> files;
  for (const auto& entry : std::filesystem::directory_iterator(folder.file("m")))
    files.push_back(entry.path().string());
  std::ranges::sort(files);
  std::vector<std::vector<std::string>> parts(1);
  for (const std::string& file : files) {
    if (file.ends_with("_changed.ply")) parts.emplace_back();
    parts.back().push_back(file);
  }
  ASSERT_GE(parts.size(), 4U);
  const auto given = [](const std::vector<std::string>& paths) {
    std::string list;
    for (const std::string& path : paths) list += path + " ";
    return list;
  };
  const Json all = detect(cut), from_files = detect("--remeshed " + given(files));
  EXPECT_EQ(all["frames"].size(), 19U);
  EXPECT_EQ(from_files["contacts_hash"], all["contacts_hash"]);
  EXPECT_EQ(detect(cut + " --bodies deformable")["contacts_hash"], all["contacts_hash"])
      << "sessions of their own";
  EXPECT_EQ(detect(cut + " --min-separation 0.01 --substeps 3")["contacts_hash"],
            detect(cut + " --min-separation 0.01 --substeps 3 --bodies components")["contacts_hash"]);
  std::size_t step = 0;
  for (const std::vector<std::string>& part : parts) {
    if (part.size() < 2) continue;
    const Json own = detect(given(part));
    for (const Json& alone : own["frames"]) {
      const Json& frame = all["frames"][step++];
      EXPECT_EQ(frame["frame"], step);
      for (const char* field : {"vf", "ee", "possible", "earliest_toi"})
        EXPECT_EQ(frame[field], alone[field]) << field << " of step " << step;
    }
  }
  EXPECT_EQ(step, 19U);
  const Json some = detect(cut + " --frames 10:14");
  ASSERT_EQ(some["frames"].size(), 4U);
  for (std::size_t i = 0; i < 4; ++i) EXPECT_EQ(some["frames"][i]["ee"], all["frames"][10 + i]["ee"]);

  const auto error = [](const std::string& arguments, int code) {
    const Outcome outcome = run(arguments, "2>&1");
    EXPECT_EQ(outcome.code, code) << arguments;
    return outcome.out;
  };
  EXPECT_THAT(error("detect " + given(files), kExitFailed),
              HasSubstr("where meshes are remeshed, `warmfront detect --remeshed` follows"));
  EXPECT_THAT(error("bench " + cut, kExitFailed),
              HasSubstr("its topology changes at frame 12, which `warmfront detect` follows"));
  EXPECT_THAT(error("detect " + cut + " --explain", kExitUsage), HasSubstr("--explain: "));
  EXPECT_THAT(error("detect " + cut + " --ended --contacts " + folder.file("c.csv"), kExitUsage),
              HasSubstr("--ended: "));
  EXPECT_THAT(error("detect " + cut + " --filter-near-at-rest 0.1", kExitUsage),
              HasSubstr("--filter-near-at-rest: "));
  EXPECT_THAT(error("scene cut --out " + folder.file("m"), kExitFailed), HasSubstr("give an empty folder"));
  std::ofstream(folder.file("bad.obj")) << "v 0 0 0\nv 1 0 0\nv 0 nan 0\nv 0 0 1\nf 1 2 3\nf 1 2 4\n";
  EXPECT_THAT(error("detect --remeshed " + given(parts[0]) + folder.file("bad.obj"), kExitFailed),
              HasSubstr("not a number"))
      << "a last mesh is looked at, too";
  EXPECT_THAT(error("detect " + cut, kExitOk), HasSubstr("the topology changes 5 times, first at frame 12"));
  EXPECT_THAT(error("detect --remeshed " + parts[0][0] + " " + parts[1][0], kExitFailed),
              HasSubstr("so they are one moment"));
}

}  // namespace
}  // namespace warmfront::client

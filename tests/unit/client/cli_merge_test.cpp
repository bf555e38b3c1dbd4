// SPDX-License-Identifier: Apache-2.0
// `warmfront detect --frames` over ranges and `warmfront merge` of their reports, as a user runs them: the
// same as one run over all frames.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <rapidcheck.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <functional>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "client/cli/exit_codes.h"
#include "tests/support/fewer_cases.h"
#include "tests/unit/client/all_ranges.h"
#include "tests/unit/client/cli_fixture.h"
#include "tests/unit/client/command.h"
#include "tests/unit/client/temporary_folder.h"

namespace warmfront::client {
namespace {

using ::testing::HasSubstr;
using Json = nlohmann::ordered_json;

/// What a report tells of contacts, step by step.
std::vector<std::string> told_of_contacts(const Json& report) {
  std::vector<std::string> steps;
  for (const Json& frame : report["frames"])
    steps.push_back(
        Json{frame["frame"], frame["vf"], frame["ee"], frame["vh"], frame["possible"], frame["earliest_toi"]}
            .dump());
  return steps;
}

/// An input of every kind, with options under which ranges might differ from a run over all frames.
struct Case {
  std::string name;
  std::string input;
  std::string contacts;  // how the files of contacts end
  std::vector<int> cuts;
};

void PrintTo(const Case& of, std::ostream* out) {
  *out << of.name;
}

class Ranges : public ::testing::TestWithParam<Case> {};

/// The input, with what it names made in the folder.
std::string made_in(const TemporaryFolder& folder, std::string input) {
  const auto replace = [&](const std::string& word, const std::function<std::string()>& by) {
    if (const std::size_t at = input.find(word); at != std::string::npos)
      input.replace(at, word.size(), by());
  };
  const auto scene = [&](const std::string& of, const std::string& name) {
    EXPECT_EQ(run("scene " + of + " --out " + folder.file(name)).code, kExitOk);
    return folder.file(name);
  };
  replace("FOLDER", [&] { return scene("bart --triangles 1000 --frames 13", "folder"); });
  replace("MDD", [&] { return scene("bart --triangles 1000 --frames 13 --cache mdd", "mdd"); });
  replace("REMESHED", [&] { return scene("cut --triangles 1200 --frames 20", "meshes") + "/*.ply"; });
  const auto write_meshes = [&](const std::string& ending) {
    std::filesystem::create_directory(folder.file("objs"));
    std::string list;
    for (int t = 0; t < 9; ++t) {
      std::string text;
      for (int v = 0; v < 3; ++v) text += "v " + std::to_string(v % 2) + " " + std::to_string(v / 2) + " 0\n";
      for (int v = 0; v < 3; ++v)
        text +=
            "v " + std::to_string(v % 2 * 0.5) + " 0.2 " + std::to_string((t % 3 - 1) * 0.3 + v * 0.1) + "\n";
      text += "f 1 2 3\nf 4 5 6\n";
      const std::string path = folder.file("objs/m" + std::to_string(t) + ending);
      std::ofstream(path) << text;
      list += path + " ";
    }
    return list;
  };
  replace("OBJS", [&] { return write_meshes(".obj"); });
  replace("RECORDING", [&] {
    expect_detected(std::string(kScene) + " --frames 0:12 --record " + folder.file("r.wfrec"));
    return folder.file("r.wfrec");
  });
  return input;
}

TEST_P(Ranges, MergeToTheRunOverAllFrames) {
  const Case& of = GetParam();
  const TemporaryFolder folder;
  const std::string input = made_in(folder, of.input);
  const auto outputs = [&](const std::string& name) {
    return " --json " + folder.file(name + ".json") + " --contacts " + folder.file(name + of.contacts);
  };
  expect_detected(input + outputs("all"));
  std::string reports;
  for (std::size_t i = 0; i + 1 < of.cuts.size(); ++i) {
    const std::string name = "part" + std::to_string(i);
    expect_detected(input + " --frames " + std::to_string(of.cuts[i]) + ":" + std::to_string(of.cuts[i + 1]) +
                    outputs(name));
    reports = folder.file(name + ".json") + " " + reports;  // in any order
  }
  const Outcome outcome = run("merge " + reports + outputs("merged"));
  ASSERT_EQ(outcome.code, kExitOk) << outcome.out;
  const Json all = Json::parse(folder.read("all.json")), merged = Json::parse(folder.read("merged.json"));
  EXPECT_EQ(merged["contacts_hash"], all["contacts_hash"]);
  EXPECT_EQ(told_of_contacts(merged), told_of_contacts(all));
  EXPECT_EQ(merged["range"]["contacts"]["rows"], all["range"]["contacts"]["rows"]);
  EXPECT_GT(all["range"]["contacts"]["rows"], 0) << "a scene without contacts shows nothing";
  for (const char* field :
       {"version", "input", "digest", "first", "last", "last_of_input", "starts_at", "ends_at", "hash"})
    EXPECT_EQ(merged["range"][field], all["range"][field]) << field;
  if (of.contacts != ".vtp") {
    EXPECT_EQ(folder.read("merged" + of.contacts), folder.read("all" + of.contacts));
    return;
  }
  for (const char* const number : {"01", "05", "12"})
    EXPECT_EQ(folder.read(std::string("merged_0000") + number + ".vtp"),
              folder.read(std::string("all_0000") + number + ".vtp"));
  EXPECT_THAT(folder.read("merged.pvd"), HasSubstr("timestep=\"12\" part=\"0\" file=\"merged_000012.vtp\""));
}

INSTANTIATE_TEST_SUITE_P(
    Cli, Ranges,
    ::testing::Values(
        Case{"builtin",
             "'builtin:bart?triangles=1000&frames=13' --min-separation 0.02",
             ".csv",
             {0, 1, 7, 12}},
        Case{"folder", "FOLDER --min-separation 0.02 --fields normal,points", ".vtp", {0, 5, 12}},
        Case{"meshes", "OBJS", ".jsonl", {0, 3, 4, 8}},
        Case{"cache", "FOLDER/mesh.ply MDD/frames.mdd --min-separation 0.02", ".csv", {0, 2, 12}},
        Case{"recording", "RECORDING --min-separation 0.02", ".csv", {0, 4, 9, 12}},
        Case{"poses", "FOLDER --send poses --min-separation 0.05", ".csv", {0, 5, 6, 12}},
        Case{"screws",
             "'builtin:turning?triangles=1000&frames=8' --substeps 2 --min-separation 0.05",
             ".jsonl",
             {0, 3, 7}},
        Case{"half_spaces",
             "'builtin:ground?triangles=1000&frames=12' --min-separation 0.05",
             ".csv",
             {0, 4, 8, 11}},
        Case{"ended", "FOLDER --ended --min-separation 0.05 --substeps 2", ".csv", {0, 5, 6, 12}},
        Case{"ended_poses", "FOLDER --ended --send poses --min-separation 0.05", ".jsonl", {0, 5, 12}},
        Case{"near_at_rest", "FOLDER --filter-near-at-rest 0.1 --min-separation 0.1", ".csv", {0, 6, 12}},
        Case{"earliest", "FOLDER --report earliest --min-separation 0.02", ".csv", {0, 6, 12}},
        Case{"cut",
             "'builtin:cut?triangles=1200&frames=20' --min-separation 0.01",
             ".csv",
             {0, 5, 12, 13, 19}},
        Case{"remeshed", "--remeshed REMESHED --min-separation 0.01", ".jsonl", {0, 12, 16, 19}}),
    [](const auto& of) { return of.param.name; });

// What is recorded of a range is what that range gave: rigid bodies begin at poses of the shape they have in
// frame 0.
TEST(Cli, ARangeWithPosesIsRecorded) {
  const TemporaryFolder folder;
  expect_detected(std::string(kScene) + " --frames 5:9 --send poses --min-separation 0.05 --record " +
                  folder.file("r.wfrec"));
  const Outcome replayed = run("replay " + folder.file("r.wfrec") + " --in-process");
  EXPECT_EQ(replayed.code, kExitOk) << replayed.out;
  EXPECT_THAT(replayed.out, HasSubstr("4 outcomes compared, all equal"));
}

// However the frames are cut, and whichever ranges are missing.
WARMFRONT_PROPERTY_OF_FEWER_CASES(Merge, OfRandomRanges) {
  const AllRanges& ranges = all_ranges();
  std::string reports;
  std::vector<std::pair<int, int>> missing;
  int there = 0;
  for (int at = 0; at < AllRanges::kFrames;) {
    const int to = *rc::gen::inRange(at + 1, AllRanges::kFrames + 1);
    if (*rc::gen::weightedElement<bool>({{5, true}, {1, false}})) {
      reports =
          *rc::gen::arbitrary<bool>() ? ranges.of(at, to) + " " + reports : reports + ranges.of(at, to) + " ";
      ++there;
    } else if (!missing.empty() && missing.back().second == at) {
      missing.back().second = to;
    } else {
      missing.emplace_back(at, to);
    }
    at = to;
  }
  RC_PRE(there > 0);
  const std::string contacts = ranges.folder().file("merged.csv");
  std::filesystem::remove(contacts);
  const Outcome outcome = run("merge " + reports + " --json - --contacts " + contacts, "2>/dev/null");
  RC_ASSERT(outcome.code == (missing.empty() ? kExitOk : kExitNo));
  const Json merged = Json::parse(outcome.out);
  RC_ASSERT(merged["missing"] == Json(missing));
  if (missing.empty()) {
    RC_ASSERT(merged["contacts_hash"] == ranges.report(0, AllRanges::kFrames)["contacts_hash"]);
    RC_ASSERT(ranges.folder().read("merged.csv") == ranges.folder().read("0-7.csv"));
  } else {
    RC_ASSERT(merged["contacts_hash"] == "");
    RC_ASSERT(!std::filesystem::exists(contacts));
  }
}

// What was merged is merged again, and a part of the input may be all that is wanted.
TEST(Merge, OfWhatWasMerged) {
  const AllRanges& ranges = all_ranges();
  const std::string later = ranges.folder().file("later.json");
  const Outcome part =
      run("merge --frames 3:7 " + ranges.of(3, 4) + " " + ranges.of(4, 7) + " --json " + later);
  ASSERT_EQ(part.code, kExitOk) << part.out;
  EXPECT_EQ(Json::parse(ranges.folder().read("later.json"))["contacts_hash"],
            ranges.report(3, 7)["contacts_hash"]);
  const Outcome whole = run("merge --json - " + ranges.of(0, 3) + " " + later, "2>/dev/null");
  ASSERT_EQ(whole.code, kExitOk);
  EXPECT_EQ(Json::parse(whole.out)["contacts_hash"], ranges.report(0, 7)["contacts_hash"]);
}

TEST(Merge, SaysWhatItFound) {
  const AllRanges& ranges = all_ranges();
  const Json all = ranges.report(0, 7);
  const std::string reports = ranges.of(0, 3) + " " + ranges.of(3, 7);
  const Outcome outcome = run("merge " + reports);
  ASSERT_EQ(outcome.code, kExitOk) << outcome.out;
  EXPECT_THAT(outcome.out, HasSubstr("7 steps in 2 reports: "));
  EXPECT_THAT(outcome.out, HasSubstr("contacts hash " + all["contacts_hash"].get<std::string>()));
  const Json merged = Json::parse(run("merge --json - " + reports, "2>/dev/null").out);
  std::vector<std::string> fields = keys(all);
  fields.insert(fields.end() - 1, {"missing", "reports", "worst"});
  EXPECT_EQ(keys(merged), fields) << "a tool that reads the one reads the other";
  const auto contacts = [](const Json& frame) {
    return frame["vf"].get<int>() + frame["ee"].get<int>() + frame["vh"].get<int>();
  };
  int most = 0;
  double earliest = 1;
  for (const Json& frame : all["frames"]) {
    most = std::max(most, contacts(frame));
    if (frame["earliest_toi"].is_number()) earliest = std::min(earliest, frame["earliest_toi"].get<double>());
  }
  ASSERT_EQ(merged["worst"]["most_contacts"].size(), 3U);
  EXPECT_EQ(merged["worst"]["most_contacts"][0]["contacts"], most);
  EXPECT_EQ(merged["worst"]["earliest"][0]["earliest_toi"], earliest);
  const auto frame = merged["worst"]["most_contacts"][0]["frame"].get<std::size_t>();
  EXPECT_EQ(contacts(all["frames"][frame - 1]), most);
  EXPECT_EQ(run("merge --contacts - " + reports, "2>/dev/null").out, ranges.folder().read("0-7.csv"));
}

// Of a long run only the worst steps have lines, unless all are asked for; the totals come first.
TEST(Merge, PrintsTheWorstSteps) {
  const TemporaryFolder folder;
  expect_detected("'builtin:bart?triangles=1000&frames=14' --min-separation 0.05 --json " +
                  folder.file("a.json"));
  const Json frames = Json::parse(folder.read("a.json"))["frames"];
  ASSERT_EQ(frames.size(), 13U);
  std::vector<std::pair<int, int>> order;  // by contacts, most first, then by frame
  for (const Json& frame : frames)
    order.emplace_back(-(frame["vf"].get<int>() + frame["ee"].get<int>()), frame["frame"].get<int>());
  std::ranges::sort(order);
  const auto steps_of = [&](const std::string& options) {
    std::istringstream lines(run("merge " + folder.file("a.json") + options).out);
    std::string line;
    std::getline(lines, line);
    EXPECT_THAT(line, HasSubstr("13 steps in 1 report: "));
    std::vector<int> steps;
    bool table = false;
    while (std::getline(lines, line)) {
      if (table) steps.push_back(std::stoi(line));
      table = table || line.find(" earliest toi ") != std::string::npos;
    }
    return steps;
  };
  std::vector<int> worst, all;
  for (std::size_t i = 0; i < 10; ++i) worst.push_back(order[i].second);
  for (const Json& frame : frames) all.push_back(frame["frame"].get<int>());
  EXPECT_EQ(steps_of(""), worst);
  EXPECT_EQ(steps_of(" --steps"), all);
  EXPECT_EQ(steps_of(" --json " + folder.file("m.json")), std::vector<int>());
  EXPECT_EQ(steps_of(" --steps --json " + folder.file("m.json")), all);
}

}  // namespace
}  // namespace warmfront::client

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
#include <map>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "client/cli/exit_codes.h"
#include "tests/unit/client/cli_fixture.h"
#include "tests/unit/client/command.h"
#include "tests/unit/client/temporary_folder.h"

namespace warmfront::client {
namespace {

using ::testing::ElementsAre;
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

void detect(const std::string& arguments) {
  const Outcome outcome = run("detect " + arguments);
  ASSERT_EQ(outcome.code, kExitOk) << arguments << "\n" << outcome.out;
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
    detect(std::string(kScene) + " --frames 0:12 --record " + folder.file("r.wfrec"));
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
  detect(input + outputs("all"));
  std::string reports;
  for (std::size_t i = 0; i + 1 < of.cuts.size(); ++i) {
    const std::string name = "part" + std::to_string(i);
    detect(input + " --frames " + std::to_string(of.cuts[i]) + ":" + std::to_string(of.cuts[i + 1]) +
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
             "'builtin:turning?triangles=1000&frames=8' --substeps 2 --min-separation 0.2",
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
  detect(std::string(kScene) + " --frames 5:9 --send poses --min-separation 0.05 --record " +
         folder.file("r.wfrec"));
  const Outcome replayed = run("replay " + folder.file("r.wfrec") + " --in-process");
  EXPECT_EQ(replayed.code, kExitOk) << replayed.out;
  EXPECT_THAT(replayed.out, HasSubstr("4 outcomes compared, all equal"));
}

/// Reports of all ranges of an input, made once.
class AllRanges {
 public:
  static constexpr int kFrames = 7;

  AllRanges() {
    for (int first = 0; first < kFrames; ++first)
      for (int last = first + 1; last <= kFrames; ++last)
        detect(std::string("'builtin:bart?triangles=1000&frames=8' --min-separation 0.05 --frames ") +
               std::to_string(first) + ":" + std::to_string(last) + " --json " + of(first, last) +
               " --contacts " + folder_.file(name(first, last) + ".csv"));
  }

  std::string of(int first, int last) const { return folder_.file(name(first, last) + ".json"); }
  Json report(int first, int last) const { return Json::parse(folder_.read(name(first, last) + ".json")); }
  const TemporaryFolder& folder() const { return folder_; }

 private:
  static std::string name(int first, int last) { return std::to_string(first) + "-" + std::to_string(last); }

  TemporaryFolder folder_;
};

const AllRanges& all_ranges() {
  static const AllRanges kRanges;
  return kRanges;
}

// However the frames are cut, and whichever ranges are missing.
RC_GTEST_PROP(Merge, OfRandomRanges, ()) {
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
  detect("'builtin:bart?triangles=1000&frames=14' --min-separation 0.05 --json " + folder.file("a.json"));
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

TEST(Merge, RefusesWhatIsNotOneRun) {
  const AllRanges& ranges = all_ranges();
  const TemporaryFolder folder;
  const auto refused = [](const std::string& arguments, int code = kExitFailed) {
    const Outcome outcome = run("merge " + arguments, "2>&1 >/dev/null");
    EXPECT_EQ(outcome.code, code) << arguments << outcome.out;
    EXPECT_EQ(std::count(outcome.out.begin(), outcome.out.end(), '\n'), 1) << outcome.out;
    return outcome.out;
  };
  EXPECT_THAT(refused(ranges.of(0, 3) + " " + ranges.of(2, 7)),
              HasSubstr("have frames in common; give only one"));
  EXPECT_THAT(refused(ranges.of(0, 7) + " " + ranges.of(0, 7)), HasSubstr("have frames in common"));
  EXPECT_THAT(refused(ranges.of(0, 2) + " " + ranges.of(5, 6), kExitNo),
              HasSubstr("frames 2:5, 6:7 (4 of 7 missing); run 'warmfront detect --frames' for each"));
  EXPECT_THAT(refused("--frames 0:3 " + ranges.of(0, 5)), HasSubstr("reaches beyond --frames 0:3"));
  EXPECT_THAT(refused(folder.file("none.json")), HasSubstr("cannot open"));

  const auto other = [&](const char* name, const std::string& arguments) {
    detect(arguments + " --json " + folder.file(name));
    return ranges.of(0, 3) + " " + folder.file(name);
  };
  const std::string same = "'builtin:bart?triangles=1000&frames=8' --frames 3:7 ";
  EXPECT_THAT(
      refused(other("a", "'builtin:bart?triangles=1000&frames=9' --frames 3:7 --min-separation 0.05")),
      HasSubstr(
          "the input is builtin:bart?triangles=1000&frames=9, not builtin:bart?triangles=1000&frames=8"));
  EXPECT_THAT(refused(other("b", same + "--min-separation 0.05 --tier exact")),
              HasSubstr("--tier is \"exact\", not"));
  EXPECT_THAT(refused(other("c", same + "--min-separation 0.06")), HasSubstr("(such as --min-separation,"));
  EXPECT_THAT(refused(other("d", same + "--min-separation 0.05 --substeps 2")),
              HasSubstr("--substeps is 2, not 1"));
  EXPECT_THAT(refused(other("e", same + "--min-separation 0.05 --bodies deformable")),
              HasSubstr("the scene, "));
  // A matter of speed is no difference, and is not told of what does not agree.
  const Outcome fine = run(
      "merge --json - " + other("f", same + "--min-separation 0.05 --front none --threads 1"), "2>/dev/null");
  EXPECT_EQ(fine.code, kExitOk);
  EXPECT_EQ(Json::parse(fine.out)["front"], nullptr);

  const auto changed = [&](const char* name, const std::function<void(Json&)>& change) {
    Json report = ranges.report(3, 7);
    change(report);
    std::ofstream(folder.file(name)) << report.dump();
    return ranges.of(0, 3) + " " + folder.file(name);
  };
  EXPECT_THAT(refused(changed("g", [](Json& r) { r["range"]["version"] = "0.1"; })),
              HasSubstr("made by warmfront 0.1, not"));
  EXPECT_THAT(refused(changed("h", [](Json& r) { r["range"]["starts_at"] = "0"; })),
              HasSubstr("the input was changed between the two runs"));
  EXPECT_THAT(refused(changed("i", [](Json& r) { r.erase("range"); })), HasSubstr("it has no \"range\""));
  EXPECT_THAT(refused(changed("j", [](Json& r) { r["frames"].erase(1); })), HasSubstr("no list of 4 steps"));
  EXPECT_THAT(refused(changed("k", [](Json& r) { r["frames"][1]["frame"] = 9; })),
              HasSubstr("lacks the step to frame 5"));
  EXPECT_THAT(refused(changed("l", [](Json& r) { r["range"]["hash"] = nullptr; })),
              HasSubstr("has no \"hash\""));
  EXPECT_THAT(refused(changed("m", [](Json& r) { r["range"]["hash"] = "12"; })),
              HasSubstr("has no \"hash\", or a wrong"));
  EXPECT_THAT(refused(changed("n", [](Json& r) { r["range"]["last"] = 3; })), HasSubstr("which is no range"));
  EXPECT_THAT(refused(changed("o", [](Json& r) { r["contacts_hash"] = ""; })), HasSubstr("--report"));
  for (const char* field : {"vertices", "tier", "contacts_hash", "frames"})
    EXPECT_THAT(refused(changed("p", [field](Json& r) { r.erase(field); })), HasSubstr(field));
  const Json fine_report = ranges.report(3, 7);
  for (const auto& item : fine_report["range"].items())
    EXPECT_THAT(refused(changed("q", [&item](Json& r) { r["range"][item.key()] = Json::object(); })),
                HasSubstr(item.key()));
  for (const auto& item : fine_report["frames"][0].items()) {
    if (item.key() == "counts" || item.key() == "bounds" || item.key() == "front_state" ||
        item.key() == "frame_bytes")
      continue;  // not looked at, or told as nothing
    EXPECT_THAT(refused(changed("r", [&item](Json& r) { r["frames"][0][item.key()] = "x"; })),
                HasSubstr(item.key()));
  }
  const std::string text = ranges.report(0, 7).dump();
  std::ofstream(folder.file("cut.json")) << text.substr(0, text.size() / 2);
  EXPECT_THAT(refused(folder.file("cut.json")),
              HasSubstr("cut short; run 'warmfront detect --json' for it again"));

  EXPECT_EQ(run("merge").code, kExitUsage);
  EXPECT_EQ(run("merge x --contacts c.txt").code, kExitUsage);
  EXPECT_EQ(run("merge x --contacts - --json -").code, kExitUsage);
  EXPECT_EQ(run("merge --frames 0:99 " + ranges.of(0, 7)).code, kExitUsage);
}

TEST(Merge, RefusesContactsThatAreNotWhatTheReportSays) {
  const TemporaryFolder folder;
  const std::string scene = "'builtin:bart?triangles=1000&frames=8' --min-separation 0.05 ";
  const auto report = [&](const char* name) { return folder.file(std::string(name) + ".json"); };
  const auto make = [&](const char* name, const std::string& options) {
    detect(scene + options + " --json " + report(name));
  };
  make("a", "--frames 0:3 --contacts " + folder.file("a.csv"));
  make("b", "--frames 3:7 --contacts " + folder.file("b.csv"));
  make("c", "--frames 3:7");
  make("d", "--frames 3:7 --contacts " + folder.file("d.jsonl"));
  const auto refused = [&](const std::string& arguments) {
    const Outcome outcome = run("merge " + arguments, "2>&1 >/dev/null");
    EXPECT_EQ(outcome.code, kExitFailed) << arguments << outcome.out;
    return outcome.out;
  };
  const std::string to = " --contacts " + folder.file("m.csv");
  EXPECT_THAT(refused(report("a") + " " + report("c") + to),
              HasSubstr("c.json: its run wrote no contacts to a file"));
  EXPECT_THAT(refused(report("a") + " " + report("d") + to), HasSubstr("name a file that ends in .jsonl"));
  EXPECT_THAT(refused(report("a") + " " + report("b") + " --contacts " + folder.file("a.csv")),
              HasSubstr("name another"));
  const std::string rows = folder.read("b.csv");
  const auto with = [&](const std::string& text) {
    std::ofstream(folder.file("b.csv")) << text;
    return refused(report("a") + " " + report("b") + to);
  };
  EXPECT_THAT(with(rows.substr(0, rows.size() - 5)),
              HasSubstr("cut short; run 'warmfront detect --frames 3:7' again"));
  EXPECT_THAT(with(rows + "x\n"), HasSubstr("it was changed or cut short"));
  EXPECT_THAT(with("frame\n" + rows), HasSubstr("its columns are 'frame', not 'frame,type"));
  std::filesystem::remove(folder.file("b.csv"));
  EXPECT_THAT(refused(report("a") + " " + report("b") + to), HasSubstr("cannot open the contacts of"));
  EXPECT_FALSE(std::filesystem::exists(folder.file("m.csv"))) << "a part of the contacts is left behind";
  // The files move with their reports.
  std::ofstream(folder.file("b.csv")) << rows;
  std::filesystem::create_directory(folder.file("elsewhere"));
  for (const char* file : {"a.json", "b.json", "a.csv", "b.csv"})
    std::filesystem::rename(folder.file(file), folder.file(std::string("elsewhere/") + file));
  const Outcome moved =
      run("merge " + folder.file("elsewhere/a.json") + " " + folder.file("elsewhere/b.json") + to);
  EXPECT_EQ(moved.code, kExitOk) << moved.out;
}

/// The names in a folder, hidden ones too.
std::vector<std::string> names_in(const TemporaryFolder& folder) {
  std::vector<std::string> names;
  for (const auto& entry : std::filesystem::directory_iterator(folder.path()))
    names.push_back(entry.path().filename().string());
  std::ranges::sort(names);
  return names;
}

// A merge that fails half-way leaves the outputs that were there as they were, and no new ones.
TEST(Merge, FailsWithoutChangingItsOutputs) {
  for (const std::string format : {".csv", ".jsonl", ".vtp"}) {
    SCOPED_TRACE(format);
    const TemporaryFolder folder;
    const std::string scene = "'builtin:bart?triangles=1000&frames=8' --min-separation 0.05 ";
    const auto outputs = [&](const std::string& name) {
      return " --json " + folder.file(name + ".json") + " --contacts " + folder.file(name + format);
    };
    detect(scene + "--frames 0:3" + outputs("a"));
    detect(scene + "--frames 3:7" + outputs("b"));
    const std::string merge = "merge " + folder.file("a.json") + " " + folder.file("b.json");
    ASSERT_EQ(run(merge + outputs("good")).code, kExitOk);
    std::filesystem::remove(folder.file(format == ".vtp" ? "b_000005.vtp" : "b" + format));
    std::map<std::string, std::string> before;
    for (const std::string& name : names_in(folder)) before[name] = folder.read(name);
    EXPECT_EQ(run(merge + outputs("good"), "2>&1").code, kExitFailed);
    EXPECT_EQ(run(merge + outputs("fresh"), "2>&1").code, kExitFailed);
    std::map<std::string, std::string> after;
    for (const std::string& name : names_in(folder)) after[name] = folder.read(name);
    EXPECT_EQ(after, before);
  }
}

// What is replaced is what a link names, with its permissions; what is no file is written to as it is.
TEST(Merge, ReplacesWhatIsThere) {
  const AllRanges& ranges = all_ranges();
  const TemporaryFolder folder;
  const std::string file = folder.write("real.csv", "old");
  std::filesystem::permissions(file, std::filesystem::perms::owner_all);
  std::filesystem::create_symlink("real.csv", folder.file("link.csv"));
  ASSERT_EQ(run("merge " + ranges.of(0, 7) + " --json /dev/null --contacts " + folder.file("link.csv")).code,
            kExitOk);
  EXPECT_TRUE(std::filesystem::is_symlink(folder.file("link.csv")));
  EXPECT_EQ(folder.read("real.csv"), ranges.folder().read("0-7.csv"));
  EXPECT_EQ(std::filesystem::status(file).permissions(), std::filesystem::perms::owner_all);
  EXPECT_THAT(names_in(folder), ElementsAre("link.csv", "real.csv"));
  EXPECT_FALSE(std::filesystem::is_regular_file("/dev/null"));
}

}  // namespace
}  // namespace warmfront::client

// SPDX-License-Identifier: Apache-2.0
// What `warmfront merge` refuses, and what is left of its outputs when it fails and when it replaces them.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <functional>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "client/cli/exit_codes.h"
#include "tests/unit/client/all_ranges.h"
#include "tests/unit/client/command.h"
#include "tests/unit/client/temporary_folder.h"

namespace warmfront::client {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using Json = nlohmann::ordered_json;

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
    expect_detected(arguments + " --json " + folder.file(name));
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
    expect_detected(scene + options + " --json " + report(name));
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
    expect_detected(scene + "--frames 0:3" + outputs("a"));
    expect_detected(scene + "--frames 3:7" + outputs("b"));
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

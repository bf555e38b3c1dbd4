// SPDX-License-Identifier: Apache-2.0
// The command line as others use it: the real binary, its exit codes, lists and scenes.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "client/cli/exit_codes.h"
#include "client/io/ply.h"
#include "tests/unit/client/cli_fixture.h"
#include "tests/unit/client/command.h"
#include "tests/unit/client/temporary_folder.h"

namespace warmfront::client {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;
using Json = nlohmann::ordered_json;

TEST(Cli, UsageErrorsExitWith3AndOneLine) {
  const TemporaryFolder folder;
  for (const std::string& arguments :
       std::vector<std::string>{"",
                                "frobnicate",
                                "detect",
                                "detect one.ply",
                                "detect one.ply folder",
                                "detect builtin:nothing",
                                "detect 'builtin:bart?triangles=1'",
                                "detect builtin:bart --bogus",
                                "detect builtin:bart --tier sharp",
                                "detect builtin:bart --front hot",
                                "detect builtin:bart --bounds ball",
                                "detect builtin:bart --report some",
                                "detect builtin:bart --tolerance 0",
                                "detect builtin:bart --tolerance nan",
                                "detect builtin:bart --tolerance x",
                                "detect builtin:bart --min-separation -1",
                                "detect builtin:bart --tier fast --min-separation 1",
                                "detect builtin:bart --leaf-size 3",
                                "detect builtin:bart --normal-cones maybe",
                                "detect builtin:bart --threads -1",
                                "detect builtin:bart --substeps 0",
                                "detect builtin:bart --bodies some",
                                "detect builtin:bart --send little",
                                "detect builtin:bart --in-flight 0",
                                "detect builtin:bart --explain --report count",
                                "detect builtin:bart --fields normal",
                                "detect builtin:bart --fields colour --contacts c.csv",
                                "detect builtin:bart --bounds sphere",
                                "detect builtin:bart --frames 3",
                                "detect builtin:bart --frames 4:2",
                                "detect builtin:bart --frames 0:999",
                                "detect builtin:bart --contacts c.txt",
                                "detect builtin:bart --contacts - --json -",
                                "detect builtin:bart --contacts - --html -",
                                "detect builtin:bart --contacts c.csv --report count",
                                "detect builtin:bart --continuity",
                                "detect builtin:bart --ended --contacts c.vtp",
                                "detect builtin:bart --continuity --contacts c.csv --report earliest",
                                "detec builtin:bart",
                                "sessions list --server 127.0.0.1",
                                "sessions list --server ::1:50051",
                                "detect builtin:bart --server unix:x --threads 2",
                                "detect builtin:bart --in-flight 2",
                                "replay x.wfrec --server unix:x --threads 2",
                                "sessions list --server unix:",
                                "sessions list --server unix:"  // a path of 108 bytes
                                "xxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxx"
                                "xxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxx",
                                "scene",
                                "scene nothing --out x",
                                "scene bart",
                                "scene bart --out x --frames 1"}) {
    const Outcome outcome = run(arguments);
    EXPECT_EQ(outcome.code, kExitUsage) << arguments << ": " << outcome.out;
    EXPECT_THAT(outcome.out, StartsWith("warmfront: ")) << arguments;
    EXPECT_EQ(std::count(outcome.out.begin(), outcome.out.end(), '\n'), 1)
        << arguments << ": " << outcome.out;
  }
}

TEST(Cli, AnUnknownOptionOrVerbIsNamedWithTheNearest) {
  EXPECT_THAT(
      run("detect builtin:bart --tolerence 3").out,
      HasSubstr("there is no option --tolerence; the nearest is --tolerance; see 'warmfront detect --help'"));
  EXPECT_THAT(run("detect builtin:bart --min-seperation=0.1").out,
              HasSubstr("the nearest is --min-separation;"));
  EXPECT_THAT(run("detect builtin:bart --frobnicate").out, HasSubstr("no option --frobnicate; see"));
  EXPECT_THAT(run("detec builtin:bart").out, HasSubstr("no verb 'detec'; the nearest is 'detect'"));
  EXPECT_THAT(run("scene bart here").out, HasSubstr("the argument 'here' is one too many"));
}

TEST(Cli, AnOptionIsNoOtherOnesValue) {
  for (const auto& [arguments, message] : std::vector<std::pair<std::string, std::string>>{
           {"detect builtin:bart --json --server unix:/nowhere.sock",
            "--json: its value is missing before --server"},
           {"detect builtin:bart --threads --tier=fast",
            "--threads: its value is missing before --tier=fast"},
           {"sessions list --server --all", "--server: its value is missing before --all"}}) {
    const Outcome outcome = run(arguments);
    EXPECT_EQ(outcome.code, kExitUsage) << arguments;
    EXPECT_THAT(outcome.out, HasSubstr(message)) << arguments;
  }
}

// A list is given with commas or by repeating the option, in every verb; a word after a space is an input.
TEST(Cli, ListsAreGivenInOneWay) {
  const TemporaryFolder folder;
  const std::string detect =
      std::string("detect ") + kScene + " --frames 8:9 --contacts " + folder.file("c.csv");
  std::vector<std::string> written;
  for (const char* fields : {" --fields normal,points", " --fields normal --fields points"}) {
    ASSERT_EQ(run(detect + fields).code, kExitOk) << fields;
    written.push_back(folder.read("c.csv"));
    EXPECT_THAT(written.back(), StartsWith("frame,type,v0,v1,v2,v3,toi,status,nx,ny,nz,ax")) << fields;
  }
  EXPECT_EQ(written[0], written[1]);
  const Outcome spaced = run(detect + " --fields normal points");
  EXPECT_EQ(spaced.code, kExitUsage) << spaced.out;
  EXPECT_THAT(spaced.out, HasSubstr("stands alone: give no other input")) << "it was taken for an input";
  EXPECT_THAT(run("load --server unix:/nowhere --limit p99=1ms,p42=1ms").out, HasSubstr("p42"));
}

TEST(Cli, FailuresExitWith2AndOneLine) {
  const TemporaryFolder folder;
  const std::string broken = folder.write("broken.ply", "ply\nformat ascii 1.0\nelement");
  const std::string nan = folder.write(
      "nan.ply", format_ply({std::vector<double>{0, 0, 0, 1, 0, 0, 0, std::nan(""), 0}, {{0, 1, 2}}}, ""));
  const std::string good =
      folder.write("good.ply", format_ply({std::vector<double>{0, 0, 0, 1, 0, 0, 0, 1, 0}, {{0, 1, 2}}}, ""));
  const std::string text = folder.write("text.obj", "hello world\n");
  for (const std::string& arguments : std::vector<std::string>{
           "detect " + folder.file("missing"), "detect " + folder.path(), "detect " + broken + " " + broken,
           "detect " + good + " " + nan, "detect " + good + " " + folder.file("missing.obj"),
           std::string("detect ") + kScene + " --frames 0:1 --contacts " + folder.file("no/c.csv"),
           std::string("detect ") + kScene + " --frames 0:1 --json " + folder.file("no/r.json"),
           std::string("detect ") + kScene + " --html " + folder.file("no/p.html"),
           "load --server unix:/nowhere --html " + folder.file("no/p.html"), "detect " + text + " " + text,
           "scene bart --frames 2 --out " + good + "/sub"}) {
    const Outcome outcome = run(arguments, "2>&1 >/dev/null");
    EXPECT_EQ(outcome.code, kExitFailed) << arguments << ": " << outcome.out;
    EXPECT_THAT(outcome.out, StartsWith("warmfront: ")) << arguments;
    EXPECT_EQ(std::count(outcome.out.begin(), outcome.out.end(), '\n'), 1)
        << arguments << ": " << outcome.out;
  }
  EXPECT_THAT(run("detect " + broken + " " + broken).out, HasSubstr("broken.ply: line 3"));
  EXPECT_THAT(run("detect " + good + " " + nan).out, HasSubstr("step to frame 1: "));
  const Outcome no_page = run(std::string("detect ") + kScene + " --html " + folder.file("no/p.html"));
  EXPECT_THAT(no_page.out, StartsWith("warmfront: ")) << "it is said before the steps, which take long";
}

TEST(Cli, AFullDiskOnStdoutFails) {
  if (!std::filesystem::exists("/dev/full")) GTEST_SKIP() << "no /dev/full on this system";
  EXPECT_EQ(run(std::string("detect ") + kScene + " --frames 0:1", ">/dev/full 2>&1").code, kExitFailed);
  EXPECT_EQ(run(std::string("detect ") + kScene + " --frames 0:1 --json -", ">/dev/full 2>&1").code,
            kExitFailed);
}

TEST(Cli, HelpAndVersion) {
  for (const char* arguments :
       {"--help", "detect --help", "scene --help", "queries --help", "accuracy --help"}) {
    const Outcome outcome = run(arguments);
    EXPECT_EQ(outcome.code, kExitOk);
    EXPECT_THAT(outcome.out, HasSubstr("Usage: warmfront"));
    EXPECT_THAT(outcome.out, HasSubstr("Exit codes"));
  }
  EXPECT_THAT(run("--version").out, StartsWith("warmfront "));
  EXPECT_EQ(run("--version").code, kExitOk);
}

TEST(Cli, PipesGetPlainLines) {
  const Outcome outcome = run(std::string("detect ") + kScene + " --frames 0:5", "2>&1");
  EXPECT_EQ(outcome.code, kExitOk);
  for (const char c : outcome.out) ASSERT_TRUE(c == '\n' || (c >= ' ' && c <= '~')) << static_cast<int>(c);
  // With a line that warns of a tangled start.
  EXPECT_EQ(std::count(outcome.out.begin(), outcome.out.end(), '\n'), 1 + 1 + 5 + 2) << outcome.out;
  EXPECT_THAT(outcome.out, HasSubstr("contacts hash "));
  EXPECT_THAT(run(std::string("detect ") + kScene + " --frames 0:2 --json -").out,
              Not(HasSubstr("steps of")));
}

TEST(Cli, AWrittenSceneIsTheBuiltinOne) {
  const TemporaryFolder folder;
  const Outcome written = run("scene flamenco --triangles 1500 --frames 12 --out " + folder.file("a/b"));
  ASSERT_EQ(written.code, kExitOk) << written.out;
  for (const char* name : {"a/b/mesh.ply", "a/b/frames.pc2", "a/b/info.json"})
    EXPECT_FALSE(folder.read(name).empty());
  const Json info = Json::parse(folder.read("a/b/info.json"));
  EXPECT_EQ(info["frames"], 12);
  EXPECT_EQ(info["bodies"].size(), 6U);
  const Outcome from_file = run("detect " + folder.file("a/b") + " --json -", "2>/dev/null");
  const Outcome built_in = run("detect 'builtin:flamenco?triangles=1500&frames=12' --json -", "2>/dev/null");
  ASSERT_EQ(from_file.code, kExitOk);
  EXPECT_EQ(Json::parse(from_file.out)["contacts_hash"], Json::parse(built_in.out)["contacts_hash"]);
  EXPECT_EQ(Json::parse(from_file.out)["vertices"], info["vertices"]);
}

TEST(Cli, ScenesAreListed) {
  const Outcome outcome = run("scene --list");
  EXPECT_EQ(outcome.code, kExitOk);
  for (const char* name : {"cloth-ball", "flamenco", "n-body", "princess", "bart", "hair", "particles",
                           "ground", "torn", "cut", "turning"})
    EXPECT_THAT(outcome.out, HasSubstr(name));
}

}  // namespace
}  // namespace warmfront::client

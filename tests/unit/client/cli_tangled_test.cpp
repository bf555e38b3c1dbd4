// SPDX-License-Identifier: Apache-2.0
// The verb `tangled`: the same pairs in this process and behind a daemon, as files tell them, and its misuse;
// and what `detect` says of a tangled start.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

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

constexpr const char* kCrossing =
    "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0.25 0.25 -1\nv 0.25 0.25 1\nv 0.3 0.3 2\nf 1 2 3\nf 4 5 6\n";
constexpr const char* kApart =
    "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0.25 0.25 2\nv 0.25 0.25 1\nv 0.3 0.3 2\nf 1 2 3\nf 4 5 6\n";

class CliTangled : public ::testing::Test {
 protected:
  CliTangled() {
    folder_.write("crossing.obj", kCrossing);
    folder_.write("apart.obj", kApart);
  }
  Outcome tangled(const std::string& arguments) const { return run("tangled " + arguments, "2>/dev/null"); }
  std::string crossing() const { return folder_.file("crossing.obj"); }
  std::string apart() const { return folder_.file("apart.obj"); }

  const TemporaryFolder folder_;
};

TEST_F(CliTangled, SaysWhatMeetsWhereAndEndsSo) {
  const Outcome both = tangled(apart() + " " + crossing());
  EXPECT_EQ(both.code, kExitNo);
  EXPECT_THAT(both.out, HasSubstr("edge 3-4 meets face 0-1-2 near (0.25, 0.25, 0)"));
  EXPECT_THAT(both.out, HasSubstr("1 of 2 frames tangled"));
  const Outcome one = tangled(apart());
  EXPECT_EQ(one.code, kExitOk);
  EXPECT_THAT(one.out, HasSubstr("0 of 1 frame tangled"));
  EXPECT_EQ(tangled(crossing() + " --any").code, kExitNo);
  EXPECT_EQ(tangled("'builtin:cloth-ball?triangles=1000&frames=9' --frames 0:2").code, kExitOk);
}

// A state needs no frame before it, as a step does.
TEST_F(CliTangled, OneFrameMayBeChosen) {
  const std::string two = apart() + " " + crossing();
  const Outcome second = tangled(two + " --frames 1:1");
  EXPECT_EQ(second.code, kExitNo);
  EXPECT_THAT(second.out, HasSubstr("1 of 1 frame tangled"));
  EXPECT_THAT(tangled(two + " --frames :0").out, HasSubstr("0 of 1 frame tangled"));
  const Outcome backward = run("tangled " + two + " --frames 1:0");
  EXPECT_EQ(backward.code, kExitUsage);
  EXPECT_THAT(backward.out, HasSubstr("FIRST must be LAST or less"));
  EXPECT_EQ(tangled(two + " --frames 2:2").code, kExitUsage);
  const Outcome step = run("detect " + two + " --frames 1:1");
  EXPECT_EQ(step.code, kExitUsage);
  EXPECT_THAT(step.out, HasSubstr("FIRST must be below LAST"));
  EXPECT_EQ(run(std::string("near ") + kNearScene + " --distance 0.05 --frames 4:4 --count", "2>&1").code,
            kExitOk);
}

TEST_F(CliTangled, HasTheSameAnswersInThisProcessAndBehindADaemon) {
  test::LocalDaemon daemon;
  for (const char* how : {"--json -", "--pairs -", "--json - --any"}) {
    const std::string arguments = apart() + " " + crossing() + " " + how;
    Outcome here = tangled(arguments), there = tangled(arguments + " --server " + daemon.address());
    EXPECT_EQ(here.code, kExitNo);
    EXPECT_EQ(there.code, kExitNo);
    if (std::string(how).starts_with("--json")) {
      Json first = Json::parse(here.out), second = Json::parse(there.out);
      EXPECT_THAT(keys(first), ElementsAre("tangled_frames", "filters", "most_thickness", "frames"));
      for (Json* json : {&first, &second})
        for (Json& frame : (*json)["frames"]) frame.erase("ms");
      EXPECT_EQ(first, second);
    } else {
      EXPECT_EQ(here.out, there.out);
      EXPECT_EQ(here.out,
                "frame,e0,e1,f0,f1,f2,x,y,z\n1,3,4,0,1,2,0.25,0.25,0\n1,3,5,0,1,2,0.27500000000000002,0."
                "27500000000000002,0.5\n");
    }
  }
}

TEST_F(CliTangled, UsageErrorsTakeOneLine) {
  for (const char* wrong : {"--any --pairs p.csv", "--pairs - --json -", "--any --html p.html",
                            "--pairs - --html -", "--html-limit 1MiB", "--frames 1", "--bodies none"}) {
    const Outcome outcome = run("tangled " + apart() + " " + wrong);
    EXPECT_EQ(outcome.code, kExitUsage) << wrong << outcome.out;
    EXPECT_THAT(outcome.out, HasSubstr("warmfront: ")) << wrong;
  }
  EXPECT_EQ(tangled("/nonexistent").code, kExitFailed);
  folder_.write("nan.obj", "v 0 0 0\nv 1 0 nan\nv 0 1 0\nf 1 2 3\n");
  const std::string nan = folder_.file("nan.obj");
  const Outcome outcome = run("tangled " + nan, "2>&1 >/dev/null");
  EXPECT_EQ(outcome.code, kExitFailed);
  EXPECT_EQ(outcome.out,
            "warmfront: " + nan + ": frame 0: positions[1].z: is not a number; coordinates must be finite\n");
}

TEST_F(CliTangled, DetectStepsThroughWhatHasTooManyToList) {
  std::string one_place;
  for (int triangle = 0; triangle < 300; ++triangle) one_place += "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
  for (int v = 1; v <= 900; v += 3)
    one_place += "f " + std::to_string(v) + " " + std::to_string(v + 1) + " " + std::to_string(v + 2) + "\n";
  folder_.write("heap.obj", one_place);
  const std::string heap = folder_.file("heap.obj");
  const Outcome warned = run("detect " + heap + " " + heap + " --report count");
  EXPECT_EQ(warned.code, kExitOk) << warned.out;
  EXPECT_THAT(warned.out, HasSubstr("frame 0 is tangled: more than 100000 pairs of edges and faces meet\n"));
}

TEST_F(CliTangled, DetectWarnsOfATangledStart) {
  const std::string warning = "frame 0 is tangled";
  const Outcome warned = run("detect " + crossing() + " " + apart());
  EXPECT_EQ(warned.code, kExitOk);
  EXPECT_THAT(warned.out, HasSubstr(warning));
  EXPECT_THAT(warned.out, HasSubstr("edge 3-4 meets face 0-1-2 near (0.25, 0.25, 0)"));
  EXPECT_THAT(run("detect " + apart() + " " + crossing()).out, ::testing::Not(HasSubstr(warning)));
}

}  // namespace
}  // namespace warmfront::client

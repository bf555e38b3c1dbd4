// SPDX-License-Identifier: Apache-2.0
// A connection that ends before the n-th byte, in either direction, for every n: the session continues, and
// each call has the same result as without the cut. In strides of 17 bytes, of which either client takes
// every other one; with WARMFRONT_EVERY_BYTE=1 both take each byte.
#include <gtest/gtest.h>

#include <cstdio>
#include <cstdlib>
#include <ostream>

#include "tests/faults/daemon_process.h"
#include "tests/faults/remote_session.h"
#include "tests/faults/switch_proxy.h"
#include "tests/support/scenes.h"

namespace warmfront::test {
namespace {

using testing::AcceptedState;
using testing::StepOperation;

// Two squares, the second of which is rigid.
AcceptedState two_squares() {
  SceneDescription scene;
  scene.vertex_count = 8;
  scene.faces = {{0, 1, 2}, {1, 3, 2}, {4, 5, 6}, {5, 7, 6}};
  scene.bodies = {{"", 0, 4}, {"", 4, 4, BodyKind::kRigid}};
  return {scene, {0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0, 0.2, 0.3, 1, 1.2, 0.3, 1, 0.2, 1.3, 1, 1.2, 1.3, 1}};
}

StepOperation lowered(double z) {
  StepOperation step;
  Pose pose;
  pose.matrix[11] = z;
  step.poses.push_back({1, pose});
  return step;
}

// A session's life; returns what went wrong, in a few words.
std::string live(SessionDriver& driver, SwitchProxy& proxy, SwitchProxy::Way way, long n) {
  RemoteSession session(driver, two_squares(), {.fields = {.normal = true}});
  if (std::string wrong = session.create(); !wrong.empty()) return wrong;
  proxy.end_before(way, n);
  testing::AddOperation add;
  add.addition.body = {"added", 0, 4};
  add.addition.faces = {{0, 1, 2}, {1, 3, 2}};
  add.positions = {0, 0, -1, 1, 0, -1, 0, 1, -1, 1, 1.25, -1};
  StepOperation raised;
  raised.vertices = {8, 9};
  raised.vertex_positions = {0, 0, 2, 1, 0, 2};
  ReplaceBody larger{1, {{"larger", 0, 5}, {{0, 1, 2}, {1, 3, 4}}, {{0, 4}}}, {}};
  larger.positions = {0, 0, 3, 1, 0, 3, 0, 1, 3, 1, 1, 3, 2, 2, 3};
  const auto calls = {
      std::function([&] { return session.step(lowered(-1.5)); }),
      std::function([&] { return session.add(add); }),
      std::function([&] { return session.step(raised); }),
      std::function([&] {
        return session.change({0, {"fixed", 0, 4, BodyKind::kStatic}});
      }),
      std::function([&] { return session.two_steps(lowered(0), lowered(-2), [] {}); }),
      std::function([&] {
        return session.change({1, {"", 4, 4, BodyKind::kDeformable}});
      }),
      std::function([&] {
        return session.change_filters({.within_edges = 1, .excluded_vertex_pairs = {{0, 5}}});
      }),
      std::function([&] {
        return session.replace(ReplaceElements{2, {{0, 1, 3}}, {{0, 2}}});
      }),
      std::function(
          [&] { return session.change_options({.min_separation = 0.1, .fields = {.points = true}}); }),
      std::function([&] { return session.change_filters({}); }),
      std::function([&] {
        return session.change_excluded_pairs({{{0, 2}}});
      }),
      std::function([&] { return session.replace(larger); }),
      std::function([&] { return session.step({}); }),
  };
  for (const auto& call : calls) {
    if (std::string wrong = call(); !wrong.empty()) return wrong;
  }
  return session.close();
}

struct Case {
  const char* name;
  std::unique_ptr<SessionDriver> (*drive)(const std::string& address);
  SwitchProxy::Way way;
  long first;  ///< byte
};
void PrintTo(const Case& one, std::ostream* out) {
  *out << one.name;
}

class RemoteEveryPlace : public ::testing::TestWithParam<Case> {};
INSTANTIATE_TEST_SUITE_P(Clients, RemoteEveryPlace,
                         ::testing::Values(Case{"CppToDaemon", drive_cpp, SwitchProxy::Way::kToDaemon, 0},
                                           Case{"CppToClient", drive_cpp, SwitchProxy::Way::kToClient, 0}),
                         [](const auto& info) { return info.param.name; });
#ifdef WARMFRONT_PYTHON
INSTANTIATE_TEST_SUITE_P(
    PythonClient, RemoteEveryPlace,
    ::testing::Values(Case{"PythonToDaemon", drive_python, SwitchProxy::Way::kToDaemon, 17},
                      Case{"PythonToClient", drive_python, SwitchProxy::Way::kToClient, 17}),
    [](const auto& info) { return info.param.name; });
#endif

TEST_P(RemoteEveryPlace, TheConnectionEnds) {
  DaemonProcess daemon;
  ASSERT_GE(daemon.port(), 0) << daemon.log();
  SwitchProxy proxy({daemon.socket().substr(5)});
  const auto driver = GetParam().drive(proxy.address());
  const bool every_byte = std::getenv("WARMFRONT_EVERY_BYTE") != nullptr;
  const long stride = every_byte ? 1 : 34;
  long ends = 0;
  for (long n = every_byte ? 0 : GetParam().first;; n += stride) {
    ASSERT_EQ(live(*driver, proxy, GetParam().way, n), "") << "the connection ended before byte " << n;
    if (!proxy.ended()) break;
    ++ends;
  }
  std::printf("%ld connections ended\n", ends);
  EXPECT_GT(ends, 10);
}

// One that is sent in pieces.
std::string live_large(SessionDriver& driver, SwitchProxy& proxy, SwitchProxy::Way way, long n) {
  RemoteSession session(driver, two_squares(), {});
  if (std::string wrong = session.create(); !wrong.empty()) return wrong;
  proxy.end_before(way, n);
  constexpr int kSide = 60;
  ReplaceBody large{1, {{"large", 0, (kSide + 1) * (kSide + 1)}, testing::grid(kSide)}, {}};
  for (int i = 0; i <= kSide; ++i)
    for (int j = 0; j <= kSide; ++j) large.positions.insert(large.positions.end(), {1.0 * i, 1.0 * j, 9});
  if (std::string wrong = session.replace(large); !wrong.empty()) return wrong;
  return session.close();
}

TEST_P(RemoteEveryPlace, TheConnectionEndsInALargeChange) {
  DaemonProcess daemon;
  ASSERT_GE(daemon.port(), 0) << daemon.log();
  SwitchProxy proxy({daemon.socket().substr(5)});
  const auto driver = GetParam().drive(proxy.address());
  const long stride = GetParam().way == SwitchProxy::Way::kToDaemon ? 9973 : 97;
  long ends = 0;
  for (long n = 0;; n += stride) {
    ASSERT_EQ(live_large(*driver, proxy, GetParam().way, n), "") << "the connection ended before byte " << n;
    if (!proxy.ended()) break;
    ++ends;
  }
  std::printf("%ld connections ended\n", ends);
  EXPECT_GT(ends, 3);
}

}  // namespace
}  // namespace warmfront::test

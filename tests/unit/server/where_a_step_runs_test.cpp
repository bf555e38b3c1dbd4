// SPDX-License-Identifier: Apache-2.0
// Where a step runs: brief ones on the thread that received them, others on a worker. That no request waits
// for one that turns out long: brief_steps_test.cpp.
#include <gmock/gmock.h>
#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>

#include <atomic>
#include <functional>
#include <future>
#include <latch>
#include <memory>
#include <sstream>
#include <thread>
#include <vector>

#include "server/transport/context.h"
#include "server/transport/session_recording.h"
#include "tests/support/observers.h"
#include "tests/unit/server/hanging_disk.h"
#include "tests/unit/server/service_fixture.h"

namespace warmfront::test {
namespace {

using server::Lane;
template <class T>
using Outcome = server::Outcome<T>;

/// Sessions without a network, and a runner that admits one guest.
class WhereAStepRunsTest : public ::testing::Test {
 protected:
  struct Made {
    std::shared_ptr<server::Session> session;
    std::vector<double> start;
    std::uint64_t steps = 0;
  };

  Made make(const MovingGrids& grids, bool rests = false, const ColliderOptions& options = {},
            std::shared_ptr<server::SessionRecording> recording = {}) {
    SceneDescription scene = grids.scene();
    if (rests) scene.bodies.push_back({"", 0, grids.vertex_count(), BodyKind::kStatic});
    server::PositionBuffer positions(server::Dtype::kFloat64, grids.vertex_count());
    std::vector<double> start = grids.positions(0);
    EXPECT_TRUE(positions.append(bytes_of(start)).ok());
    auto session = server::Session::create(
        {server::SessionId::parse(kId).value(), std::move(scene), options, server::Dtype::kFloat64, 0, {}},
        positions,
        {.workers = workers_,
         .runner = runner_,
         .limits = limits_,
         .account = server::Account::open(budget_, 1 << 30, 0).value(),
         .lost = [](server::Session&, const server::Fault&) {},
         .companion = std::move(recording)});
    return {session.value(), std::move(start)};
  }
  /// Whether the next step, in which nothing moves, runs on this thread.
  bool stays(Made& made, std::uint64_t frame) {
    server::FrameBuffer contents(server::Dtype::kFloat64, *made.session->scene());
    static_cast<void>(contents.append(bytes_of(made.start)));
    std::thread::id ran;
    std::promise<void> done;
    made.session->submit({frame,
                          server::FrameQuestion{std::move(contents)},
                          {},
                          tell_frame([&](const server::FrameOutcome&) { done.set_value(); },
                                     [&] { ran = std::this_thread::get_id(); })},
                         server::Session::Admission::kAlways);
    done.get_future().wait();
    settle();
    return ran == std::this_thread::get_id();
  }
  bool stays(Made& made) { return stays(made, ++made.steps); }
  /// Whether one of the next steps does. A step of which others took the core, or that an instrumented build
  /// made slow, is taken for a long one, and so is the next.
  bool stays_soon(Made& made) {
    constexpr int kMany = 20;
    for (int i = 0; i < kMany; ++i)
      if (stays(made)) return true;
    return false;
  }
  /// A static one, of 39,204 triangles, far from the others; before the frame after the last step.
  void add_large_body(Made& made) {
    const MovingGrids large(100);
    server::AddBody add;
    add.addition.body.vertex_count = large.vertex_count();
    add.addition.body.kind = BodyKind::kStatic;
    add.addition.faces = large.scene().faces;
    add.positions = large.positions(0);
    for (std::size_t i = 2; i < add.positions.size(); i += 3) add.positions[i] += 100;
    made.start.insert(made.start.end(), add.positions.begin(), add.positions.end());
    std::promise<void> changed;
    made.session->change({made.steps + 1, {std::move(add)}},
                         tell_change([&](const server::Outcome<server::SessionState>& outcome) {
                           EXPECT_TRUE(outcome.ok());
                           changed.set_value();
                         }));
    changed.get_future().wait();
    settle();
  }
  /// A request's answer comes before its job has ended; until then the next one would wait for it.
  void settle() {
    for (const Lane lane : {Lane::kShort, Lane::kLong}) {
      std::latch done(1);
      runner_.post([&] { done.count_down(); }, lane);
      done.wait();
    }
  }

  const std::shared_ptr<Workers> workers_ = std::make_shared<Workers>(2);
  server::Budget budget_{1 << 30};
  server::Limits limits_;
  server::Runner runner_{1, {1}};
};

TEST_F(WhereAStepRunsTest, OnTheCallersThreadAfterABriefStep) {
  Made made = make(MovingGrids(3));
  EXPECT_FALSE(stays(made)) << "the first step cannot be predicted";
  EXPECT_TRUE(stays(made));
  EXPECT_TRUE(stays(made));
  EXPECT_EQ(made.session->snapshot().steps, 3u);
}

TEST_F(WhereAStepRunsTest, OnAWorkerAfterAnyOtherRequest) {
  Made made = make(MovingGrids(3), true);
  EXPECT_FALSE(stays(made));
  EXPECT_TRUE(stays(made));
  std::promise<void> changed, checked;
  made.session->change(
      {3, {server::ChangeBody{0, {"", 0, static_cast<std::uint32_t>(made.start.size() / 3)}}}},
      tell_change([&](const server::Outcome<server::SessionState>& outcome) {
        EXPECT_TRUE(outcome.ok());
        changed.set_value();
      }));
  changed.get_future().wait();
  settle();
  EXPECT_FALSE(stays(made)) << "the first step of a changed scene may be long";
  EXPECT_TRUE(stays(made));
  made.session->check([&](const Outcome<std::string>& outcome) {
    EXPECT_TRUE(outcome.ok());
    checked.set_value();
  });
  checked.get_future().wait();
  settle();
  EXPECT_FALSE(stays(made)) << "the step may have to rebuild what a check found broken";
  EXPECT_TRUE(stays(made));
  EXPECT_TRUE(stays(made, 99)) << "out of order";
  EXPECT_FALSE(stays(made)) << "a cancelled frame may have been long, and so may its repetition";
  EXPECT_EQ(made.session->snapshot().steps, 7u);
}

TEST_F(WhereAStepRunsTest, OnAWorkerAfterALargeBodyWasAdded) {
  Made made = make(MovingGrids(3), true);
  EXPECT_FALSE(stays(made));
  EXPECT_TRUE(stays(made));
  add_large_body(made);
  EXPECT_FALSE(stays(made));
  EXPECT_FALSE(stays(made));
  EXPECT_EQ(made.session->snapshot().steps, 4u);
}

TEST_F(WhereAStepRunsTest, OnAWorkerWhenASelfCheckIsDue) {
  limits_.self_check_steps = 2;
  Made made = make(MovingGrids(3));
  for (const bool expected : {false, true, false, true, false})
    EXPECT_EQ(stays(made), expected) << made.steps;
}

TEST_F(WhereAStepRunsTest, OnAWorkerWhenASecondColliderMakesItLong) {
  const MovingGrids grids(76);  // 22,500 triangles
  ColliderOptions options;
  Made alone = make(grids, true, options);
  EXPECT_FALSE(stays(alone));
  EXPECT_TRUE(stays_soon(alone));
  options.explain = true;
  Made explained = make(grids, true, options);
  EXPECT_FALSE(stays_soon(explained));
}

TEST_F(WhereAStepRunsTest, OnTheCallersThreadEvenIfTheRecordingDiskHangs) {
  const TemporaryFolder folder;
  const auto disk = std::make_shared<HangingDisk>();
  std::ostringstream text;
  server::Log log(server::LogLevel::kInfo, server::LogFormat::kText, &text);
  const auto recordings =
      server::Recordings::open(folder.path(), 1 << 30, log, {.put = HangingDisk::put(disk)}).value();
  {
    Made made =
        make(MovingGrids(3), false, {}, recordings->begin(server::SessionId::parse(kId).value(), nullptr));
    EXPECT_FALSE(stays(made)) << "the first step cannot be predicted";
    EXPECT_TRUE(stays(made));
    EXPECT_TRUE(stays(made));
    EXPECT_EQ(made.session->snapshot().steps, 3u);
  }
  disk->go_on();
}

}  // namespace
}  // namespace warmfront::test

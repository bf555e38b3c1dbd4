// SPDX-License-Identifier: Apache-2.0
// A program written once for either kind of session: the same questions in this process and behind a daemon
// have the same answers; and the verb `solve`, which is such a program.
#include "client/lib/any_session.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numeric>
#include <optional>
#include <string>
#include <vector>

#include "client/cli/exit_codes.h"
#include "tests/unit/client/command.h"
#include "tests/unit/server/local_daemon.h"
#include "tests/unit/server/moving_grids.h"

namespace warmfront::client {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using Json = nlohmann::ordered_json;

class AnySessionTest : public ::testing::Test {
 protected:
  static constexpr int kSide = 8;

  template <class Number>
  std::vector<AnySession> open(const std::vector<Number>& start, const ColliderOptions& options) {
    const std::span<const Number> positions(start);
    std::vector<AnySession> both;
    both.push_back(AnySession::create(grids_.scene(), positions, options).value());
    both.emplace_back(client_.create_session(grids_.scene(), positions, options).value());
    return both;
  }
  template <class Number>
  std::vector<Number> at(std::uint64_t frame) const {
    const std::vector<double> positions = grids_.positions(frame);
    return {positions.begin(), positions.end()};
  }
  template <class Number>
  void expect_the_same() {
    std::vector<AnySession> both = open(at<Number>(0), {.fields = {true, false, true}});
    EXPECT_FALSE(both[0].is_remote());
    EXPECT_TRUE(both[1].is_remote());
    std::size_t contacts = 0;
    int cut_short = 0;
    std::ptrdiff_t nearer = 0;
    std::size_t merged_rows = 0;
    for (std::uint64_t k = 1; k <= 12; ++k) {
      const std::vector<Number> there = at<Number>(k);
      const Frame frame{std::span<const Number>(there)};
      const auto same = [&](const Result<Answer>& a, const Result<Answer>& b) {
        ASSERT_TRUE(a.ok() && b.ok()) << k;
        EXPECT_EQ(a.value().frame, b.value().frame);
        EXPECT_EQ(a.value().vf, b.value().vf);
        EXPECT_EQ(a.value().ee, b.value().ee);
        EXPECT_EQ(a.value().possible, b.value().possible);
        EXPECT_EQ(a.value().earliest_toi, b.value().earliest_toi);
        EXPECT_EQ(a.value().contacts, b.value().contacts);
        contacts += a.value().contacts.size();
      };
      same(both[0].trial(frame), both[1].trial(frame));
      for (const Where where : {Where::kBase, Where::kTrialEnd}) {
        const auto a = both[0].vertex_distances(0.3, where), b = both[1].vertex_distances(0.3, where);
        same(a, b);
        EXPECT_EQ(a.value().vertex_distances.size(), grids_.scene().vertex_count);
        EXPECT_EQ(a.value().vertex_distances, b.value().vertex_distances);
        for (const auto& fields : {ContactFields{}, ContactFields{.weights = true, .closest = true}}) {
          const QuestionOptions reduced{.fields = fields, .reduced = true};
          const auto one = both[0].proximity(0.3, where, reduced),
                     two = both[1].proximity(0.3, where, reduced);
          same(one, two);
          const ContactTable& rows = one.value().contacts;
          EXPECT_EQ(rows.multiplicity.size(), rows.size());
          EXPECT_EQ(std::accumulate(rows.multiplicity.begin(), rows.multiplicity.end(), std::uint64_t{0}),
                    one.value().vf + one.value().ee);
          merged_rows += one.value().vf + one.value().ee - rows.size();
        }
        nearer += std::ranges::count_if(a.value().vertex_distances, [](double d) { return d < 0.3; });
      }
      const auto here = both[0].max_step(frame, true, {.min_separation = 0.01});
      const auto far = both[1].max_step(frame, true, {.min_separation = 0.01});
      ASSERT_TRUE(here.ok() && far.ok());
      EXPECT_EQ(here.value().fraction, far.value().fraction);
      EXPECT_EQ(here.value().overlaps_at_start, far.value().overlaps_at_start);
      const QuestionOptions keeping{.min_separation = 1e-3, .keep_distance = 0.5};
      const auto kept_here = both[0].max_step(frame, true, keeping);
      const auto kept_there = both[1].max_step(frame, true, keeping);
      ASSERT_TRUE(kept_here.ok() && kept_there.ok());
      EXPECT_EQ(kept_here.value().fraction, kept_there.value().fraction);
      EXPECT_EQ(kept_here.value().answer.contacts.size() > 0, kept_here.value().fraction < 1);
      cut_short += kept_here.value().fraction > 0 && kept_here.value().fraction < 1 ? 1 : 0;
      if (k % 3 == 0) {
        const auto committed = both[0].commit(0.3), there_too = both[1].commit(0.3);
        ASSERT_TRUE(committed.ok() && there_too.ok());
        EXPECT_EQ(committed.value().earliest_toi, there_too.value().earliest_toi);
        EXPECT_EQ(committed.value().vf, there_too.value().vf);
      } else {
        same(both[0].step(frame), both[1].step(frame));
      }
    }
    EXPECT_GT(contacts, 50U);
    EXPECT_GT(cut_short, 6);
    EXPECT_GT(nearer, 100);
    EXPECT_GT(merged_rows, 100U);
  }

  test::LocalDaemon daemon_;
  Client client_ = Client::connect(daemon_.address()).value();
  const test::MovingGrids grids_{kSide};
};

TEST_F(AnySessionTest, AnswersAreTheSameBits) {
  expect_the_same<double>();
  expect_the_same<float>();
}

TEST_F(AnySessionTest, AfterATrialThatIsRefusedThereIsNone) {
  const std::vector<double> there = at<double>(1);
  const Frame frame{std::span<const double>(there)};
  for (AnySession& session : open(at<double>(0), {})) {
    const std::vector<QuestionOptions> wrong{{.tolerance = 0.0},
                                             {.report = Report::kAny},
                                             {.keep_distance = 0.5},
                                             {.reduced = true},
                                             {.max_contacts = 0}};
    for (const QuestionOptions& options : wrong) {
      ASSERT_TRUE(session.trial(frame).ok());
      Pending<Answer> refused = session.trial_async(frame, options);
      Pending<Answer> near = session.proximity_async(0.1, Where::kTrialEnd);
      Pending<Answer> tangled = session.intersections_async(Where::kTrialEnd);
      EXPECT_FALSE(refused.get().ok());
      for (Pending<Answer>* question : {&near, &tangled}) {
        const Result<Answer> answer = question->get();
        ASSERT_FALSE(answer.ok()) << session.is_remote();
        EXPECT_EQ(answer.error().code, ErrorCode::kFailedPrecondition) << answer.error().message;
      }
      EXPECT_FALSE(session.commit(1).ok());
    }
  }
}

TEST_F(AnySessionTest, AQuestionAboutAStateThatFailsLeavesTheTrial) {
  const std::vector<double> there = at<double>(1), start = at<double>(0);
  const Frame frame{std::span<const double>(there)};
  Session remote = client_.create_session(grids_.scene(), std::span<const double>(start)).value();
  for (int round = 0; round < 2; ++round) {
    ASSERT_TRUE(remote.trial(frame).ok());
    EXPECT_FALSE(remote.proximity(std::nan("")).ok());
    EXPECT_FALSE(remote.proximity(0.5, Where::kTrialEnd, {.max_contacts = 0}).ok());
    EXPECT_FALSE(remote.proximity(0.5, Where::kTrialEnd, {.max_contacts = 1}).ok());
    EXPECT_TRUE(remote.commit(0.5).ok());
  }
  EXPECT_EQ(remote.resumes(), 0U);
}

TEST_F(AnySessionTest, WhatIsAskedBehindAStepThatIsRefusedFails) {
  const std::vector<double> there = at<double>(1), few{0, 0, 0};
  const Frame frame{std::span<const double>(there)}, wrong{std::span<const double>(few)};
  for (AnySession& session : open(at<double>(0), {})) {
    const auto behind = [&](auto&& refused) {
      Pending<Answer> step = session.step_async(frame), trial = session.trial_async(frame);
      EXPECT_FALSE(refused.get().ok());
      for (Pending<Answer>* question : {&step, &trial}) {
        const Result<Answer> answer = question->get();
        ASSERT_FALSE(answer.ok()) << session.is_remote();
        EXPECT_EQ(answer.error().code, ErrorCode::kFailedPrecondition);
      }
    };
    behind(session.commit_async(0.5));
    behind(session.step_async(wrong));
    behind(session.place_async(wrong));
    EXPECT_EQ(session.step(frame).value().frame, 1U) << session.is_remote();
    {
      Pending<Answer> nobody_waits = session.step_async(wrong);
    }
    Pending<Answer> told = session.step_async(frame);
    EXPECT_FALSE(told.get().ok());
    EXPECT_EQ(session.step(frame).value().frame, 2U) << session.is_remote();
  }
}

TEST_F(AnySessionTest, WhatOneOfThemRefusesSoDoesTheOther) {
  const std::vector<double> there = at<double>(1);
  const std::vector<float> in_float = at<float>(1);
  const Frame frame{std::span<const double>(there)}, other{std::span<const float>(in_float)};
  for (AnySession& session : open(at<double>(0), {})) {
    const auto invalid = [&](const auto& answer, const char* words) {
      ASSERT_FALSE(answer.ok()) << session.is_remote() << words;
      EXPECT_EQ(answer.error().code, ErrorCode::kInvalidArgument);
      EXPECT_THAT(answer.error().message, HasSubstr(words));
    };
    invalid(session.max_step(frame, false, {.report = Report::kAll}), "report: max_step reports the earliest");
    invalid(session.max_step(frame, false, {.fields = ContactFields{.normal = true}}),
            "fields: max_step tells of times");
    invalid(session.step(other), "positions: the session was created with float64 positions");
    EXPECT_TRUE(session.step(frame).ok());
  }
}

TEST_F(AnySessionTest, ErrorsHaveTheSameCodesAndChangeNothing) {
  for (AnySession& session : open(at<double>(0), {})) {
    EXPECT_EQ(session.commit().error().code, ErrorCode::kFailedPrecondition);
    std::vector<double> bad = at<double>(1);
    bad[7] = std::numeric_limits<double>::quiet_NaN();
    EXPECT_EQ(session.trial(Frame{std::span<const double>(bad)}).error().code, ErrorCode::kInvalidArgument);
    EXPECT_EQ(session.change_body(100, {}).error().code, ErrorCode::kInvalidArgument);
    BodyAddition triangle;
    triangle.body.vertex_count = 3;
    triangle.faces = {{0, 1, 2}};
    const std::vector<double> corners = {50, 0, 0, 51, 0, 0, 50, 1, 0};
    EXPECT_EQ(session.add_body(triangle, std::span<const double>(corners)).error().code,
              ErrorCode::kFailedPrecondition)
        << "to a scene that declares no bodies";
    const std::vector<double> moved = at<double>(1);
    EXPECT_EQ(session.trial(Frame{std::span<const double>(moved)}).value().frame, 1U);
    EXPECT_EQ(session.commit(1.5).error().code, ErrorCode::kInvalidArgument);
    for (const double s : {0.0, 1.0, std::numeric_limits<double>::quiet_NaN()}) {
      const auto refused =
          session.max_step(Frame{std::span<const double>(moved)}, false, {.keep_distance = s});
      ASSERT_FALSE(refused.ok());
      EXPECT_EQ(refused.error().code, ErrorCode::kInvalidArgument);
      EXPECT_THAT(refused.error().message, HasSubstr("keep_distance: "));
    }
    const auto other = session.step(Frame{std::span<const double>(moved)}, {.keep_distance = 0.5});
    ASSERT_FALSE(other.ok());
    EXPECT_EQ(other.error().code, ErrorCode::kInvalidArgument);
    EXPECT_EQ(session.commit().error().code, ErrorCode::kFailedPrecondition) << "there is no trial to commit";
    EXPECT_EQ(session.trial(Frame{std::span<const double>(moved)}).value().frame, 1U);
    EXPECT_TRUE(session.commit(0.5).ok());
  }
}

// Callers keep bodies by their numbers: the place in the frame's list alone tells them nothing.
TEST_F(AnySessionTest, WhatIsWrongWithABodysMotionIsSaidOfThatBodyAndInTheSameWords) {
  SceneDescription scene = grids_.scene();
  constexpr std::uint32_t kEach = kSide * kSide;
  scene.bodies = {{"floor", 0, kEach, BodyKind::kStatic}, {"cloth", kEach, kEach}};
  const std::vector<double> start = at<double>(0);
  std::vector<AnySession> both;
  both.push_back(AnySession::create(scene, std::span<const double>(start), {}).value());
  both.emplace_back(client_.create_session(scene, std::span<const double>(start), {}).value());
  std::vector<double> moved(start.begin() + 3 * kEach, start.end());
  moved[22] = std::nan("");
  const std::vector<float> rounded(moved.begin(), moved.end());
  const std::vector<std::pair<Positions, std::string>> wrong{
      {std::span<const double>(moved), "positions[7].y: is not a number; coordinates must be finite"},
      {std::span<const double>(moved).first(3),
       "positions: 3 values where 192 are expected (3 for each of 64 vertices)"},
      {std::span<const float>(rounded),
       "positions: the session was created with float64 positions; give every frame the same kind"}};
  for (const auto& [positions, what] : wrong) {
    const BodyPositions body{1, positions};
    Frame frame;
    frame.bodies = {&body, 1};
    for (AnySession& session : both) {
      const Result<Answer> answer = session.step(frame);
      ASSERT_FALSE(answer.ok()) << what;
      EXPECT_EQ(answer.error().message, "frame 1: bodies[0]: body 1 (\"cloth\"): " + what)
          << session.is_remote();
    }
  }
}

TEST_F(AnySessionTest, RefusalsOfBodiesAndOfTheirVerticesSayWhatToGive) {
  SceneDescription scene = grids_.scene();
  Body plane{"ground", 0, 0, BodyKind::kRigid};
  plane.half_space = HalfSpace{{0, 0, -9}, {0, 0, 1}};
  scene.bodies = {plane, {"grids", 0, scene.vertex_count}};
  const std::vector<double> start = at<double>(0);
  const std::array<BodyPositions, 1> bodies{{{0, std::span<const double>(start).first(9)}}};
  Frame frame;
  frame.bodies = bodies;
  std::vector<AnySession> both;
  both.push_back(AnySession::create(scene, std::span<const double>(start), {}).value());
  both.emplace_back(client_.create_session(scene, std::span<const double>(start), {}).value());
  for (AnySession& session : both) {
    EXPECT_THAT(session.replace_elements(7, {}).error().message,
                HasSubstr("index: body 7 is not in [0, 2); give the number of one of the scene's bodies"));
    EXPECT_THAT(session.replace_elements(1, {{0, 1, 128}}).error().message,
                HasSubstr("bodies[1]: faces[0][2]: vertex index 128 is not in [0, 128); a body's faces and "
                          "edges number its own vertices, from 0"));
    EXPECT_THAT(session.step(frame).error().message,
                HasSubstr("bodies[0]: body 0 (\"ground\") is a half-space, which has no positions; it moves "
                          "by poses: give its pose"));
  }
}

class CliSolve : public ::testing::Test {
 protected:
  static Json report(const std::string& arguments) {
    const Outcome outcome =
        run("solve 'builtin:cloth-ball?triangles=1000&frames=9' --json - " + arguments, "2>/dev/null");
    EXPECT_EQ(outcome.code, kExitOk) << outcome.out;
    return Json::parse(outcome.out);
  }
};

TEST_F(CliSolve, HasTheSameAnswersInThisProcessAndBehindADaemon) {
  test::LocalDaemon daemon;
  for (const char* how :
       {"", "--max-step", "--max-step --keep-distance 0.5", "--trials 2 --shrink 1 --min-separation 0.05"}) {
    const Json here = report(how), there = report(std::string(how) + " --server " + daemon.address());
    EXPECT_EQ(here["contacts_hash"], there["contacts_hash"]) << how;
    ASSERT_EQ(here["frames"].size(), 8U);
    ASSERT_EQ(there["frames"].size(), 8U);
    for (std::size_t k = 0; k < 8; ++k) {
      EXPECT_EQ(here["frames"][k].contains("max_step"), std::string(how).starts_with("--max-step"));
      if (here["frames"][k].contains("max_step")) {
        EXPECT_EQ(here["frames"][k]["max_step"], there["frames"][k]["max_step"]);
      }
      for (std::size_t trial = 0; trial < here["frames"][k]["trials"].size(); ++trial)
        for (const char* what : {"length", "vf", "ee", "earliest_toi"})
          EXPECT_EQ(here["frames"][k]["trials"][trial][what], there["frames"][k]["trials"][trial][what]);
    }
  }
}

TEST_F(CliSolve, JsonHasTheFieldsThatToolsRead) {
  const Json json = report("--compare --trials 2");
  EXPECT_THAT(keys(json), ElementsAre("tier", "trials", "shrink", "contacts_hash", "median_ms", "filters",
                                      "most_thickness", "frames"));
  EXPECT_THAT(keys(json["median_ms"]),
              ElementsAre("first_trial", "further_trial", "commit", "frame", "step"));
  const Json& frame = json["frames"][0];
  EXPECT_THAT(keys(frame), ElementsAre("frame", "trials", "commit_ms", "step_ms"));
  ASSERT_EQ(frame["trials"].size(), 2U);
  EXPECT_EQ(frame["trials"][0]["length"], 1.0);
  EXPECT_EQ(frame["trials"][1]["length"], 0.7);
}

TEST_F(CliSolve, UsageErrorsTakeOneLine) {
  for (const char* wrong : {"--trials 0", "--shrink 1.5", "--keep 0.5", "--keep-distance 0.5",
                            "--max-step --keep-distance 1", "--max-step --keep-distance nan",
                            "--max-step --keep-distance 0.5 --tier fast", "--frames 5:2", "--tier best"}) {
    const Outcome outcome = run(std::string("solve 'builtin:cloth-ball?triangles=1000&frames=9' ") + wrong);
    EXPECT_EQ(outcome.code, kExitUsage) << wrong << outcome.out;
    EXPECT_THAT(outcome.out, HasSubstr("warmfront: ")) << wrong;
  }
  EXPECT_EQ(run("solve /nonexistent").code, kExitFailed);
}

}  // namespace
}  // namespace warmfront::client

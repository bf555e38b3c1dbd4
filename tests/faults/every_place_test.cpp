// SPDX-License-Identifier: Apache-2.0
// Every failure at every place: each operation of short scripts meets every possible failure: the n-th
// allocation fails, alone or with all later ones, the step is cancelled at the n-th look at its flag, or it
// has more than k contacts, for every n and k. The collider must then be, bit for bit, as before the call,
// and behave like one without the failure. WARMFRONT_FAULT_SEEDS: number of additional random scripts (6).
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <map>
#include <ostream>

#include "tests/support/accepted_state.h"
#include "tests/support/carry_out.h"
#include "tests/support/failing_allocations.h"
#include "tests/support/scenes.h"

namespace warmfront::testing {
namespace {

struct Script {
  std::string name;
  AcceptedState start;
  ColliderOptions options;
  std::vector<Operation> operations;
  std::size_t first = 0;  // that meets failures
};

void PrintTo(const Script& script, std::ostream* out) {
  *out << script.name;
}

constexpr int kStepsAfter = 10;

// For crashes: the current case.
std::string now_trying;  // NOLINT: read by the handler below
[[noreturn]] void tell_and_end() {
  std::fprintf(stderr, "the process ended in: %s\n", now_trying.c_str());
  std::abort();
}
const auto installed = std::set_terminate(tell_and_end);

const std::shared_ptr<Workers>& one_thread() {
  static const auto workers = std::make_shared<Workers>(1);
  return workers;
}

// A step and what is right of it.
struct Step {
  AcceptedState before;
  Operation operation;
  Outcome expected;
  AcceptedState after;
};

// Those that hold after the operation.
ColliderOptions options_after(const Operation& operation, const ColliderOptions& before) {
  const auto* changes = std::get_if<ChangesOperation>(&operation);
  return changes != nullptr && changes->options ? *changes->options : before;
}

std::vector<Step> draw_steps(std::uint64_t seed, const AcceptedState& from, const ColliderOptions& options) {
  Draws draws(seed);
  std::vector<Step> steps;
  AcceptedState state = from;
  for (int i = 0; i < kStepsAfter; ++i) {
    Step step{state, draw_step(draws, state), {}, {}};
    step.expected = state.brute_force(std::get<StepOperation>(step.operation), options);
    state.accept(step.operation);
    step.after = state;
    steps.push_back(std::move(step));
  }
  return steps;
}

// Operation `at` of a script, with what is right before and after it.
class Place {
 public:
  Place(const Script& script, std::size_t at, std::shared_ptr<Workers> workers = one_thread())
      : script_(script),
        at_(at),
        workers_(std::move(workers)),
        before_(script.start),
        options_(script.options) {
    for (std::size_t i = 0; i < at; ++i) {
      before_.accept(script.operations[i]);
      options_ = options_after(script.operations[i], options_);
    }
    after_ = before_;
    after_.accept(operation());
    steps_before_ = draw_steps(2 * at, before_, options_);
    steps_after_ = draw_steps(2 * at + 1, after_, options_after(operation(), options_));
  }

  const Operation& operation() const { return script_.operations[at_]; }
  std::string name() const {
    return script_.name + ", operation " + std::to_string(at_) + ", " + to_string(operation());
  }

  /// Colliders without failures, one that ran the script and one without history, continue as brute force
  /// says.
  void learn() {
    Collider control = arrive();
    expect_as_before(control);
    go_on(control, steps_before_, "control");
    Collider fresh = before_.fresh(options_, workers_);
    go_on(fresh, steps_before_, "fresh");
    Collider through = arrive();
    expected_ = carry_out(through, operation());
    ASSERT_TRUE(expected_.done()) << to_string(expected_);
    expect_done(through, expected_);
  }

  /// A collider just before the operation.
  Collider arrive() const {
    Collider collider = script_.start.fresh(script_.options, workers_);
    for (std::size_t i = 0; i < at_; ++i) {
      const Outcome outcome = carry_out(collider, script_.operations[i]);
      if (!outcome.done())
        throw std::logic_error(to_string(script_.operations[i]) + ": " + to_string(outcome));
    }
    return collider;
  }

  /// Injects the fault into the operation. False: it did not occur, so no later place need be tried.
  bool meet(const Fault& fault) const {
    now_trying = name() + ", " + to_string(fault);
    Collider collider = arrive();
    const Outcome outcome = carry_out(collider, operation(), fault);
    if (outcome.done()) {
      expect_done(collider, outcome);
      return outcome.met_fault;
    }
    expect_failed(outcome, fault);
    expect_as_before(collider);
    go_on(collider, steps_before_, "after the failure");
    Collider retried = arrive();
    // With several threads there may be no such place the next time: then it is done.
    const Outcome once_more = carry_out(retried, operation(), fault);
    expect_done(retried, once_more.done() ? once_more : carry_out(retried, operation()));
    return true;
  }

  /// One collider meets one fault after another, repeatedly, and then continues.
  void meet_all(Fault fault, long most) const {
    Collider collider = arrive();
    // Caches for the next call may remain; a leak grows with every failure.
    bool grows = true;
    for (int round = 0; grows && round < 12; ++round) {
      const std::size_t held = live_bytes();
      for (fault.n = 0; fault.n < most; ++fault.n) {
        now_trying = name() + ", one after the other, " + to_string(fault);
        // The call absorbed the failure; meet() has checked that.
        if (carry_out(collider, operation(), fault).done()) return;
      }
      expect_as_before(collider);
      grows = live_bytes() > held;
    }
    EXPECT_FALSE(grows) << "memory is lost with every failure";
    go_on(collider, steps_before_, "after all failures");
  }

 private:
  void expect_done(Collider& collider, const Outcome& outcome) const {
    EXPECT_EQ(difference(outcome, expected_), "") << "the operation itself";
    EXPECT_EQ(after_.difference(collider), "");
    go_on(collider, steps_after_, "after the operation");
  }
  void expect_failed(const Outcome& outcome, const Fault& fault) const {
    const bool right = fault.kind == Fault::Kind::kCancelled ? outcome.refused(ErrorCode::kCancelled)
                                                             : outcome.kind == Outcome::Kind::kOutOfMemory;
    EXPECT_TRUE(right) << to_string(outcome);
  }
  void expect_as_before(Collider& collider) const {
    EXPECT_EQ(before_.difference(collider), "");
    EXPECT_TRUE(collider.options() == options_);
    const Status sound = collider.self_check();
    EXPECT_TRUE(sound.ok()) << sound.error().message;
  }
  static void go_on(Collider& collider, std::span<const Step> steps, const char* when) {
    for (std::size_t i = 0; i < steps.size(); ++i) {
      std::string differs = difference(carry_out(collider, steps[i].operation), steps[i].expected);
      if (differs.empty()) differs = steps[i].after.difference(collider);
      EXPECT_EQ(differs, "") << when << ", step " << i
                             << " of those that follow: " << to_string(steps[i].operation);
      if (!differs.empty()) return;
    }
  }

  const Script& script_;
  const std::size_t at_;
  const std::shared_ptr<Workers> workers_;
  AcceptedState before_, after_;
  ColliderOptions options_;  // before it
  std::vector<Step> steps_before_, steps_after_;
  Outcome expected_;
};

// ---- scripts ----

SceneDescription two_bodies(BodyKind first, BodyKind second, int n) {
  SceneDescription scene;
  const auto corners = static_cast<std::uint32_t>((n + 1) * (n + 1));
  for (int body = 0; body < 2; ++body) {
    for (auto face : grid(n)) {
      for (auto& v : face) v += body * static_cast<int>(corners);
      scene.faces.push_back(face);
    }
  }
  scene.vertex_count = 2 * corners;
  scene.bodies = {{"", 0, corners, first}, {"", corners, corners, second}};
  return scene;
}

std::vector<double> sheet(int n, double height) {
  std::vector<double> positions;
  for (int i = 0; i <= n; ++i) {
    for (int j = 0; j <= n; ++j) positions.insert(positions.end(), {1.0 * i / n, 1.0 * j / n, height});
  }
  return positions;
}
std::vector<double> joined(std::vector<double> a, const std::vector<double>& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

Pose shifted(double x, double y, double z) {
  Pose pose;
  pose.matrix[3] = x;
  pose.matrix[7] = y;
  pose.matrix[11] = z;
  return pose;
}
StepOperation posed(std::uint32_t body, const Pose& pose) {
  StepOperation step;
  step.poses.push_back({body, pose});
  return step;
}
StepOperation everything(std::vector<double> positions) {
  StepOperation step;
  step.all = std::move(positions);
  return step;
}

// A rigid sheet over a deformable one: poses, positions, poses of the shape that these made, single vertices.
Script poses_and_positions() {
  Script script{"poses and positions",
                {two_bodies(BodyKind::kDeformable, BodyKind::kRigid, 2), joined(sheet(2, 0), sheet(2, 0.5))},
                {},
                {}};
  script.options.fields = {.weights = true, .normal = true, .points = true};
  script.operations.emplace_back(posed(1, shifted(0.1, 0.05, 0)));
  script.operations.emplace_back(everything(joined(sheet(2, 0), sheet(2, 0.2))));
  script.operations.emplace_back(posed(1, shifted(0.03, 0.01, -0.3)));
  StepOperation mixed = posed(1, shifted(0.03, 0.01, 0.3));
  mixed.vertices = {4, 0};
  mixed.vertex_positions = {0.5, 0.5, 0.6, 0, 0, 0.1};
  script.operations.emplace_back(mixed);
  StepOperation rows;
  rows.bodies.push_back({1, sheet(2, -0.1)});
  rows.vertices = {8};
  rows.vertex_positions = {1, 1, -0.3};
  script.operations.emplace_back(rows);
  script.operations.emplace_back(posed(1, shifted(0, 0, 0.25)));
  script.operations.emplace_back(StepOperation{});
  return script;
}

// Sheets within the separation: contacts of stationary features are cached.
Script contacts_at_rest(Report report) {
  Script script{
      "contacts at rest, report " + std::string(to_string(report)),
      {two_bodies(BodyKind::kDeformable, BodyKind::kDeformable, 3), joined(sheet(3, 0), sheet(3, 0.04))},
      {},
      {}};
  script.options.min_separation = 0.05;
  script.options.report = report;
  script.operations.emplace_back(StepOperation{});
  script.operations.emplace_back(StepOperation{});
  StepOperation one;
  one.vertices = {13};
  one.vertex_positions = {0.5, 0.5, -0.01};
  script.operations.emplace_back(one);
  script.operations.emplace_back(StepOperation{});
  script.operations.emplace_back(StepOperation{});
  return script;
}

// Bodies that fall rigidly, so that they are found to be rigid.
Script falling() {
  Script script{
      "falling",
      {two_bodies(BodyKind::kDeformable, BodyKind::kDeformable, 2), joined(sheet(2, 0), sheet(2, 0.5))},
      {},
      {},
      14};
  for (int i = 1; i <= 20; ++i)
    script.operations.emplace_back(everything(joined(sheet(2, -i / 64.0), sheet(2, 0.5 - i / 32.0))));
  std::vector<double> crumpled = joined(sheet(2, -20 / 64.0), sheet(2, -0.125));
  crumpled[3 * 4 + 2] += 0.3;
  script.operations.emplace_back(everything(crumpled));
  return script;
}

Script changes() {
  Script script{"changes",
                {two_bodies(BodyKind::kDeformable, BodyKind::kRigid, 2), joined(sheet(2, 0), sheet(2, 0.5))},
                {},
                {}};
  script.operations.emplace_back(posed(1, shifted(0, 0, -0.2)));
  script.operations.emplace_back(ChangeOperation{0, {"", 0, 9, BodyKind::kRigid}});
  script.operations.emplace_back(posed(0, shifted(0.02, 0.03, 0.35)));
  script.operations.emplace_back(ChangeOperation{1, {"", 9, 9, BodyKind::kDeformable}});
  Body body{"a", 0, 9, BodyKind::kDeformable};
  script.operations.emplace_back(AddOperation{{body, grid(2)}, sheet(2, 0.4)});
  StepOperation rows;
  rows.bodies.push_back({2, sheet(2, 0.2)});
  script.operations.emplace_back(rows);
  body.kind = BodyKind::kRigid;
  script.operations.emplace_back(AddOperation{{body, grid(2)}, sheet(2, 0.1)});
  script.operations.emplace_back(posed(3, shifted(0.01, 0.02, 0.3)));
  script.operations.emplace_back(ChangeOperation{0, {"", 0, 9, BodyKind::kStatic}});
  script.operations.emplace_back(posed(3, shifted(0.01, 0.02, -0.3)));
  script.operations.emplace_back(ChangeOperation{2, {"", 18, 9, BodyKind::kRemoved}});
  script.operations.emplace_back(posed(3, shifted(0.01, 0.02, 0.3)));
  return script;
}

// Several as one: bodies that are added, changed at once and taken out again, one that is rigid before and
// after but was not in between, and names alone.
Script changes_together() {
  Script script{"changes together",
                {two_bodies(BodyKind::kDeformable, BodyKind::kRigid, 2), joined(sheet(2, 0), sheet(2, 0.5))},
                {},
                {}};
  const Body soft{"soft", 0, 9, BodyKind::kDeformable};
  const Body hard{"hard", 0, 9, BodyKind::kRigid};
  script.operations.emplace_back(posed(1, shifted(0.1, 0, -0.2)));
  script.operations.emplace_back(ChangesOperation{
      {AddBody{{soft, grid(2)}, sheet(2, 0.4)}, ChangeBody{1, {"", 9, 9, BodyKind::kDeformable}},
       AddBody{{hard, grid(2)}, sheet(2, -0.2)}, ChangeBody{2, {"", 18, 9, BodyKind::kRigid}},
       ChangeBody{1, {"", 9, 9, BodyKind::kRigid}}}});
  StepOperation all = posed(1, shifted(0.01, 0.02, -0.4));
  all.poses.push_back({2, shifted(0.01, 0.02, -0.5)});
  all.poses.push_back({3, shifted(0.01, 0.02, 0.7)});
  script.operations.emplace_back(all);
  script.operations.emplace_back(ChangesOperation{
      {ChangeBody{0, {"named", 0, 9, BodyKind::kDeformable}}, ChangeBody{3, {"", 27, 9, BodyKind::kRigid}}}});
  script.operations.emplace_back(ChangesOperation{
      {AddBody{{soft, grid(2)}, sheet(2, 0.45)}, ChangeBody{3, {"", 27, 9, BodyKind::kRemoved}},
       ChangeBody{4, {"", 36, 9, BodyKind::kRemoved}}, ChangeBody{0, {"", 0, 9, BodyKind::kStatic}},
       AddBody{{soft, grid(2)}, sheet(2, 0.3)}}});
  StepOperation fall = posed(2, shifted(0, 0, 0.2));
  fall.bodies.push_back({5, sheet(2, -0.3)});
  script.operations.emplace_back(fall);
  return script;
}

// Trials of all kinds from one base, by other options than the session's, and commits of all of one and of
// part.
Script trials() {
  Script script{"trials",
                {two_bodies(BodyKind::kDeformable, BodyKind::kRigid, 2), joined(sheet(2, 0), sheet(2, 0.3))},
                {},
                {}};
  const auto trial = [](StepOperation step) {
    step.as = StepOperation::As::kTrial;
    return step;
  };
  StepOperation far = trial(posed(1, shifted(0.1, 0.05, -0.6)));
  StepOperation near = trial(posed(1, shifted(0.05, 0.02, -0.4)));
  near.options.min_separation = 0.1;
  StepOperation most = posed(1, shifted(0.1, 0.05, -0.6));
  most.as = StepOperation::As::kMaxStep;
  StepOperation both = trial(everything(joined(sheet(2, 0.02), sheet(2, -0.2))));
  both.options.fields = ContactFields{.normal = true};
  StepOperation kept = most;
  kept.options.keep_distance = 0.5;
  for (const StepOperation& one : {far, near, most, kept, far}) script.operations.emplace_back(one);
  script.operations.emplace_back(CommitOperation{0.5, Rounding::kFloat64});
  const QuestionOptions told{.fields = ContactFields{.direction = true, .squared_distance = true}};
  for (const StepOperation& one : {near, both, far}) script.operations.emplace_back(one);
  for (const Where where : {Where::kTrialEnd, Where::kBase, Where::kTrialEnd})
    script.operations.emplace_back(NearOperation{0.2, where, told});
  script.operations.emplace_back(CommitOperation{1, Rounding::kFloat64});
  script.operations.emplace_back(both);
  script.operations.emplace_back(CommitOperation{0, Rounding::kFloat64});
  script.operations.emplace_back(posed(1, shifted(0, 0, 0.2)));
  script.operations.emplace_back(NearOperation{0.5, Where::kBase, {}});
  script.operations.emplace_back(NearOperation{0.1, Where::kBase, told});
  const QuestionOptions by_vertex{.report = Report::kVertexDistances};
  script.operations.emplace_back(NearOperation{0.4, Where::kBase, by_vertex});
  const QuestionOptions reduced{.fields = ContactFields{.weights = true}, .reduced = true};
  script.operations.emplace_back(NearOperation{0.3, Where::kBase, reduced});
  script.operations.emplace_back(NearOperation{0, Where::kBase, {}, true});
  script.operations.emplace_back(both);
  script.operations.emplace_back(NearOperation{0, Where::kTrialEnd, {.report = Report::kAny}, true});
  script.operations.emplace_back(NearOperation{0.2, Where::kTrialEnd, by_vertex});
  script.operations.emplace_back(NearOperation{0.2, Where::kTrialEnd, {.reduced = true}});
  return script;
}

// Filters of all kinds, beside a body that is added and alone, and none again.
Script filters() {
  Script script{"filters",
                {two_bodies(BodyKind::kDeformable, BodyKind::kRigid, 2), joined(sheet(2, 0), sheet(2, 0.3))},
                {},
                {}};
  script.start.scene.filters = {.within_edges = 1, .patches = std::vector<std::uint32_t>(18, 1)};
  const Body soft{"soft", 0, 9, BodyKind::kDeformable};
  script.operations.emplace_back(posed(1, shifted(0.1, 0.05, -0.6)));
  script.operations.emplace_back(AddOperation{{soft, grid(2)}, sheet(2, -0.2)});
  PairFilters other{.within_edges = 2,
                    .near_at_rest = 0.25,
                    .rest_positions = joined(joined(sheet(2, 0), sheet(2, 0.3)), sheet(2, -0.2)),
                    .excluded_vertex_pairs = {{0, 9}, {26, 4}}};
  script.operations.emplace_back(ChangesOperation{{ChangeFilters{other}}});
  script.operations.emplace_back(posed(1, shifted(0.1, 0.05, 0.1)));
  script.operations.emplace_back(NearOperation{0.4, Where::kBase, {}});
  other.rest_positions.insert(other.rest_positions.end(), 27, 0.5);
  script.operations.emplace_back(
      ChangesOperation{{AddBody{{soft, grid(2)}, sheet(2, 0.1)}, ChangeFilters{other}}});
  script.operations.emplace_back(posed(1, shifted(0.1, 0.05, -0.3)));
  script.operations.emplace_back(ChangesOperation{{ChangeFilters{}}});
  script.operations.emplace_back(posed(1, shifted(0.1, 0.05, 0)));
  return script;
}

// Options and excluded pairs, alone and with other changes.
Script options() {
  Script script{"options",
                {two_bodies(BodyKind::kDeformable, BodyKind::kRigid, 2), joined(sheet(2, 0), sheet(2, 0.3))},
                {},
                {}};
  const Body soft{"soft", 0, 9, BodyKind::kDeformable};
  script.operations.emplace_back(posed(1, shifted(0.1, 0.05, -0.6)));
  script.operations.emplace_back(ChangesOperation{{ChangeExcludedPairs{{{0, 1}}}}});
  script.operations.emplace_back(posed(1, shifted(0.1, 0.05, 0.1)));
  ColliderOptions other;
  other.min_separation = 0.1;
  other.front = FrontMode::kNone;
  script.operations.emplace_back(ChangesOperation{{ChangeExcludedPairs{}}, other});
  script.operations.emplace_back(posed(1, shifted(0.1, 0.05, -0.3)));
  other.min_separation = 0;
  other.tier = Tier::kExact;
  script.operations.emplace_back(
      ChangesOperation{{AddBody{{soft, grid(2)}, sheet(2, 0.1)}, ChangeExcludedPairs{{{1, 2}}}}, other});
  script.operations.emplace_back(posed(1, shifted(0.1, 0.05, 0)));
  script.operations.emplace_back(ChangesOperation{{}, ColliderOptions{}});
  script.operations.emplace_back(posed(1, shifted(0.1, 0.05, -0.2)));
  return script;
}

// Elements and bodies that are replaced, alone and with other changes, beside bodies at poses.
Script replacements() {
  Script script{"replacements",
                {two_bodies(BodyKind::kDeformable, BodyKind::kRigid, 2), joined(sheet(2, 0), sheet(2, 0.3))},
                {},
                {}};
  const Body soft{"soft", 0, 9, BodyKind::kDeformable};
  const Body finer{"finer", 0, 16, BodyKind::kDeformable};
  Faces torn = grid(2);
  torn.resize(5);
  script.operations.emplace_back(posed(1, shifted(0.1, 0.05, -0.6)));
  script.operations.emplace_back(ChangesOperation{{ReplaceElements{1, torn, {{0, 8}}}}});
  script.operations.emplace_back(posed(1, shifted(0.1, 0.05, 0.1)));
  script.operations.emplace_back(ChangesOperation{{ReplaceBody{0, {finer, grid(3)}, sheet(3, -0.2)}}});
  script.operations.emplace_back(posed(1, shifted(0.1, 0.05, -0.4)));
  script.operations.emplace_back(
      ChangesOperation{{AddBody{{soft, grid(2)}, sheet(2, 0.1)}, ReplaceElements{0, grid(3), {}},
                        ChangeBody{1, {"", 16, 9, BodyKind::kDeformable}}}});
  StepOperation rows;
  rows.bodies.push_back({2, sheet(2, -0.3)});
  script.operations.emplace_back(rows);
  ReplaceBody gone{1, {{}, {}}, {}};
  gone.addition.body.kind = BodyKind::kRemoved;
  script.operations.emplace_back(ChangesOperation{{gone}});
  rows.bodies.back().positions = sheet(2, 0.1);
  script.operations.emplace_back(rows);
  script.operations.emplace_back(
      ChangesOperation{{ReplaceBody{1, {soft, grid(2)}, sheet(2, 0.2)}, ReplaceElements{1, torn, {}}}});
  rows.bodies.push_back({1, sheet(2, -0.4)});
  script.operations.emplace_back(rows);
  return script;
}

// Few elements of a body, of which the hierarchy of the rest is kept; where that finds no room, too.
Script replaced_locally() {
  Script script{"replaced locally",
                {two_bodies(BodyKind::kDeformable, BodyKind::kRigid, 4), joined(sheet(4, 0), sheet(4, 0.3))},
                {},
                {}};
  Faces torn = grid(4);
  torn.erase(torn.begin() + 6);
  Faces turned = torn;
  std::swap(turned[9][0], turned[9][1]);
  Faces filled = turned;
  filled.insert(filled.end(), {{0, 1, 7}, {3, 8, 12}});
  script.operations.emplace_back(posed(1, shifted(0.1, 0.05, -0.6)));
  script.operations.emplace_back(ChangesOperation{{ReplaceElements{0, torn, {{0, 24}}}}});
  script.operations.emplace_back(posed(1, shifted(0.1, 0.05, 0.1)));
  script.operations.emplace_back(ChangesOperation{{ReplaceElements{0, turned, {}}}});
  script.operations.emplace_back(posed(1, shifted(0.1, 0.05, -0.4)));
  script.operations.emplace_back(ChangesOperation{{ReplaceElements{0, filled, {}}}});
  script.operations.emplace_back(posed(1, shifted(0.1, 0.05, 0.2)));
  return script;
}

// A scene without declared bodies, as a whole.
Script replaced_whole() {
  Script script{
      "replaced whole",
      {two_bodies(BodyKind::kDeformable, BodyKind::kDeformable, 2), joined(sheet(2, 0), sheet(2, 0.3))},
      {},
      {}};
  script.start = {{script.start.scene.vertex_count, script.start.scene.faces, {}}, script.start.positions};
  script.operations.emplace_back(everything(joined(sheet(2, 0.1), sheet(2, 0.05))));
  Faces torn = script.start.scene.faces;
  torn.resize(13);
  script.operations.emplace_back(ChangesOperation{{ReplaceElements{0, torn, {{16, 17}}}}});
  script.operations.emplace_back(everything(joined(sheet(2, 0), sheet(2, 0.2))));
  return script;
}

Script placed() {
  Script script{"placed",
                {two_bodies(BodyKind::kRigid, BodyKind::kRigid, 2), joined(sheet(2, 0), sheet(2, 0.5))},
                {},
                {}};
  script.operations.emplace_back(PlaceOperation{{{0, shifted(0, 0, 0.1)}, {1, shifted(0.1, 0, 0)}}});
  script.operations.emplace_back(PlaceOperation{{{1, shifted(0.1, 0.1, 0)}}});
  script.operations.emplace_back(posed(1, shifted(0.03, 0.01, -0.6)));
  script.operations.emplace_back(CheckOperation{});
  script.operations.emplace_back(posed(0, shifted(0.03, 0.01, -0.6)));
  script.operations.emplace_back(ForgetOperation{});
  script.operations.emplace_back(posed(0, shifted(0.03, 0.01, 0.1)));
  return script;
}

// Coordinates so far apart in size that only integers of any length hold them: GMP's.
Script exact_numbers() {
  Script script{
      "exact",
      {two_bodies(BodyKind::kDeformable, BodyKind::kDeformable, 1), joined(sheet(1, 0), sheet(1, 0x1p-80))},
      {},
      {}};
  script.options.tier = Tier::kExact;
  std::vector<double> down = joined(sheet(1, 0), sheet(1, -0x1p-90));
  down[3 * 4] = 0x1p-200;
  script.operations.emplace_back(everything(down));
  script.operations.emplace_back(everything(joined(sheet(1, 0), sheet(1, 0))));
  script.operations.emplace_back(everything(joined(sheet(1, 0x1p-300), sheet(1, -0x1p-310))));
  return script;
}

// Enough steps for `auto` to try the other bounds, and to decide.
Script kinds_of_bounds() {
  Script script{"auto bounds",
                {two_bodies(BodyKind::kDeformable, BodyKind::kRigid, 2), joined(sheet(2, 0), sheet(2, 0.5))},
                {},
                {}};
  script.options.bounds = BoundsKind::kAuto;
  for (int i = 0; i < 40; ++i)
    script.operations.emplace_back(posed(1, shifted(0.01, 0.02, i % 2 == 0 ? -0.6 : 0.1)));
  script.first = 9;
  return script;
}

Script drawn(std::uint64_t seed) {
  Draws draws(seed);
  Script script{"drawn with seed " + std::to_string(seed), draw_state(draws), {}, {}};
  // Some far from the origin, some very small or large.
  if (seed % 4 == 3)
    script.start = scaled(script.start, std::ldexp(1, 20 * (draws.below(7) - 3)), draws.below(3) * 1000.0);
  ColliderOptions& options = script.options;
  options.front = static_cast<FrontMode>(draws.below(3));
  options.bounds = static_cast<BoundsKind>(draws.below(2));
  options.leaf_size = 1U << draws.below(7);
  options.min_separation = draws.below(2) == 0 ? 0.05 * script.start.unit : 0;
  options.lazy_front = draws.below(2) == 0;
  options.separate_parts = draws.below(3) != 0;
  options.report = static_cast<Report>(draws.below(3));
  options.explain = draws.below(4) == 0;
  options.normal_cones = draws.below(4) == 0;
  AcceptedState state = script.start;
  for (int i = 0; i < 6; ++i) {
    const bool bodies = !state.scene.bodies.empty();
    const auto draw = [&]() -> Operation {
      if (bodies && draws.below(6) == 0) return draw_addition(draws, state);
      if (bodies && draws.below(4) == 0) {
        const ChangeOperation change = draw_change(draws, state);
        if (state.scene.bodies[change.body].kind != BodyKind::kRemoved) return change;
      }
      return draw_step(draws, state);
    };
    script.operations.push_back(draw());
    state.accept(script.operations.back());
  }
  return script;
}

std::uint64_t seeds() {
  const char* text = std::getenv("WARMFRONT_FAULT_SEEDS");
  return text == nullptr ? 6 : std::strtoull(text, nullptr, 10);
}

std::vector<Script> scripts() {
  std::vector<Script> all{poses_and_positions(),
                          contacts_at_rest(Report::kAll),
                          contacts_at_rest(Report::kCount),
                          contacts_at_rest(Report::kEarliest),
                          falling(),
                          changes(),
                          changes_together(),
                          trials(),
                          filters(),
                          options(),
                          replacements(),
                          replaced_locally(),
                          replaced_whole(),
                          placed(),
                          exact_numbers(),
                          kinds_of_bounds()};
  for (std::uint64_t seed = 1; seed <= seeds(); ++seed) all.push_back(drawn(seed));
  return all;
}

class EveryPlace : public ::testing::TestWithParam<Script> {
 protected:
  // All there are of a kind, at every operation.
  static void meet_every(Fault::Kind kind) {
    const Script& script = GetParam();
    long met = 0;
    for (std::size_t at = script.first; at < script.operations.size(); ++at) {
      Place place(script, at);
      SCOPED_TRACE(place.name());
      place.learn();
      if (HasFatalFailure()) return;
      Fault fault{kind};
      for (bool more = true; more && !HasFailure(); ++fault.n) {
        SCOPED_TRACE(to_string(fault));
        more = place.meet(fault);
      }
      if (HasFailure()) return;
      met += fault.n - 1;
      place.meet_all({kind}, fault.n - 1);
    }
    std::printf("%s: %ld faults met\n", script.name.c_str(), met);
  }
};
std::string name_of(const ::testing::TestParamInfo<Script>& info) {
  std::string name = info.param.name;
  std::erase_if(name, [](char c) { return c == ','; });
  std::replace(name.begin(), name.end(), ' ', '_');
  return name;
}
INSTANTIATE_TEST_SUITE_P(Scripts, EveryPlace, ::testing::ValuesIn(scripts()), name_of);

TEST_P(EveryPlace, AnAllocationFails) {
  meet_every(Fault::Kind::kAllocation);
}

TEST_P(EveryPlace, AllAllocationsFailFromThereOn) {
  meet_every(Fault::Kind::kAllAllocations);
}

TEST_P(EveryPlace, CancelledAtEveryLook) {
  meet_every(Fault::Kind::kCancelled);
}

// Answers by brute force, each worked out once however many contacts are allowed.
class KnownAnswers {
 public:
  Outcome of(const AcceptedState& state, const StepOperation& step, ColliderOptions options) {
    if (step.as != StepOperation::As::kStep || step.options != QuestionOptions{})
      return state.brute_force(step, options);
    const std::size_t most = options.max_contacts;
    options.max_contacts = ColliderOptions{}.max_contacts;
    AcceptedState after = state;
    after.accept(step);
    std::vector<double> key = state.positions;
    key.insert(key.end(), {options.min_separation, static_cast<double>(options.tier)});
    for (const auto& [a, b] : state.scene.excluded_pairs) key.insert(key.end(), {1.0 * a, 1.0 * b});
    key.insert(key.end(), after.positions.begin(), after.positions.end());
    for (const Body& body : state.scene.bodies) key.push_back(static_cast<double>(body.kind));
    for (const auto& face : state.scene.faces) key.insert(key.end(), face.begin(), face.end());
    for (const auto& edge : state.scene.edges) key.insert(key.end(), edge.begin(), edge.end());
    const auto [known, added] = known_.try_emplace(std::move(key));
    if (added) known->second = state.brute_force(step, options);
    if (options.report == Report::kCount || known->second.contacts.size() <= most) return known->second;
    Outcome refused;
    refused.kind = Outcome::Kind::kRefused;
    refused.error.code = ErrorCode::kResourceExhausted;
    return refused;
  }

 private:
  std::map<std::vector<double>, Outcome> known_;
};

// A failed create() leaks nothing.
TEST_P(EveryPlace, WhileItIsMade) {
  const Script& script = GetParam();
  const auto scene = std::make_shared<const Scene>(Scene::create(script.start.scene).value());
  const std::span<const double> positions = script.start.positions;
  const auto workers = one_thread();
  // What the first one makes once for all.
  ASSERT_TRUE(Collider::create(scene, positions, script.options, workers).ok());
  long n = 0;
  for (bool failed = true; failed; ++n) {
    now_trying = script.name + ", create(), allocation " + std::to_string(n);
    const std::size_t before = live_bytes();
    failed = false;
    const FailingAllocations failing(n);
    try {
      const auto collider = Collider::create(scene, positions, script.options, workers);
      EXPECT_TRUE(collider.ok());
    } catch (const std::bad_alloc&) {
      failed = true;
    }
    ASSERT_TRUE(failed || !FailingAllocations::met()) << "allocation " << n << " failed unseen";
    ASSERT_EQ(live_bytes(), before) << "after allocation " << n << " failed";
  }
  std::printf("%s: %ld faults met\n", script.name.c_str(), n - 1);
}

// The script with max_contacts k, for every k: a refused operation has no effect, and the others continue
// from there.
bool moves_static_body(const AcceptedState& state, const StepOperation& step) {
  if (!step.all) return false;
  return std::ranges::any_of(state.scene.bodies, [&](const Body& body) {
    const auto first = static_cast<std::ptrdiff_t>(3 * body.first_vertex);
    return body.kind == BodyKind::kStatic &&
           !std::equal(state.positions.begin() + first,
                       state.positions.begin() + first + 3 * body.vertex_count, step.all->begin() + first);
  });
}

TEST_P(EveryPlace, MoreContactsThanAllowed) {
  const Script& script = GetParam();
  KnownAnswers answers;
  long refusals = 0;
  bool refused = true;
  for (std::size_t k = 0; refused; ++k) {
    SCOPED_TRACE("max_contacts " + std::to_string(k));
    ColliderOptions options = script.options;
    options.max_contacts = k;
    Collider collider = script.start.fresh(options, one_thread());
    AcceptedState state = script.start;
    refused = false;
    const auto expect_right = [&](const Operation& operation) {
      SCOPED_TRACE(to_string(operation));
      const Outcome outcome = carry_out(collider, operation);
      if (const auto* step = std::get_if<StepOperation>(&operation)) {
        ASSERT_EQ(difference(outcome, answers.of(state, *step, options)), "");
      }
      const auto* near = std::get_if<NearOperation>(&operation);
      const bool of_trial = std::holds_alternative<CommitOperation>(operation) ||
                            (near != nullptr && near->where == Where::kTrialEnd);
      const bool no_trial = of_trial && !state.trial;
      if (near != nullptr && !no_trial) {
        ASSERT_EQ(difference(outcome, state.brute_force(*near, options)), "");
      }
      ASSERT_TRUE(outcome.done() ||
                  outcome.refused(no_trial ? ErrorCode::kFailedPrecondition : ErrorCode::kResourceExhausted))
          << to_string(outcome);
      ASSERT_FALSE(no_trial && outcome.done());
      refused |= !outcome.done();
      if (!outcome.done() && near == nullptr) state.trial.reset();
      refusals += outcome.done() ? 0 : 1;
      if (outcome.done()) {
        state.accept(operation);
        options = options_after(operation, options);
      }
      ASSERT_EQ(state.difference(collider), "");
    };
    for (Operation operation : script.operations) {
      auto* changes = std::get_if<ChangesOperation>(&operation);
      if (changes != nullptr && changes->options) changes->options->max_contacts = k;
      // What moved a body in a frame that was refused here does not lead to where the script has it, static.
      const auto* step = std::get_if<StepOperation>(&operation);
      if (step != nullptr && moves_static_body(state, *step)) break;
      ASSERT_NO_FATAL_FAILURE(expect_right(operation));
    }
    Draws draws(k % 4);
    for (int i = 0; i < kStepsAfter; ++i)
      ASSERT_NO_FATAL_FAILURE(expect_right(Operation(draw_step(draws, state))));
  }
  std::printf("%s: %ld faults met\n", script.name.c_str(), refusals);
}

// Which allocation fails depends on the threads; the outcome must not.
TEST_P(EveryPlace, OnTwoThreads) {
  const Script& script = GetParam();
  const auto workers = std::make_shared<Workers>(2);
  for (std::size_t at = script.first; at < script.operations.size(); at += 2) {
    Place place(script, at, workers);
    SCOPED_TRACE(place.name());
    place.learn();
    for (const Fault::Kind kind : {Fault::Kind::kAllocation, Fault::Kind::kCancelled}) {
      for (long n = 0; n < 40 && !HasFailure(); ++n) {
        const Fault fault{kind, n * n / 4};
        SCOPED_TRACE(to_string(fault));
        if (!place.meet(fault)) break;
      }
    }
  }
}

// A question that ran out of memory as it began knows of some of the parts that were added, and not of others.
TEST(PlaceAfterAFailure, ReadsNoPartThatWasNotAdded) {
  Script script{"placed after a failure",
                {two_bodies(BodyKind::kDeformable, BodyKind::kRigid, 2), joined(sheet(2, 0), sheet(2, 0.3))},
                {},
                {}};
  const Body body{"a", 0, 9, BodyKind::kDeformable};
  const AddOperation added{{body, grid(2)}, sheet(2, 0.4)};
  const std::vector<double> low = joined(joined(sheet(2, 0), sheet(2, 0.2)), sheet(2, 0.1));
  const StepOperation step = everything(low);
  StepOperation place = everything(joined(joined(sheet(2, 0), sheet(2, 0.3)), sheet(2, 0.5)));
  place.as = StepOperation::As::kPlace;
  bool failed = true;
  for (long n = 0; failed; ++n) {
    SCOPED_TRACE("allocation " + std::to_string(n));
    Collider collider = script.start.fresh(script.options, one_thread());
    AcceptedState state = script.start;
    const auto take = [&](const Operation& operation) {
      ASSERT_TRUE(carry_out(collider, operation).done());
      state.accept(operation);
    };
    ASSERT_NO_FATAL_FAILURE(take(everything(joined(sheet(2, 0.1), sheet(2, 0.35)))));
    ASSERT_NO_FATAL_FAILURE(take(added));
    failed = !carry_out(collider, step, {Fault::Kind::kAllocation, n}).done();
    if (!failed) break;
    ASSERT_NO_FATAL_FAILURE(take(place));
    ASSERT_EQ(difference(carry_out(collider, step), state.brute_force(step, script.options)), "");
  }
}

}  // namespace
}  // namespace warmfront::testing

// SPDX-License-Identifier: Apache-2.0
#include "tests/faults/fault_scripts.h"

#include <cmath>
#include <cstdlib>

#include "tests/faults/fault_scripts_changes.h"
#include "tests/faults/small_sheets.h"

namespace warmfront::testing {
namespace {

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

// Trials of all kinds from one base, with options of their own, and commits of all of one and of
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

// Coordinates so far apart in size that only integers of any length hold them: GMP's. Two triangles: each
// pair of features makes hundreds of allocations, so that those of few pairs are already all that there are.
Script exact_numbers() {
  const auto triangle = [](double height) {
    return std::vector<double>{0, 0, height, 0, 1, height, 1, 0, height};
  };
  SceneDescription scene;
  scene.vertex_count = 6;
  scene.faces = {{0, 1, 2}, {3, 4, 5}};
  scene.bodies = {{"", 0, 3, BodyKind::kDeformable}, {"", 3, 3, BodyKind::kDeformable}};
  Script script{"exact", {scene, joined(triangle(0), triangle(0x1p-80))}, {}, {}};
  script.options.tier = Tier::kExact;
  std::vector<double> down = joined(triangle(0), triangle(-0x1p-90));
  down[3 * 3] = 0x1p-200;
  script.operations.emplace_back(everything(down));
  script.operations.emplace_back(everything(joined(triangle(0), triangle(0))));
  script.operations.emplace_back(everything(joined(triangle(0x1p-300), triangle(-0x1p-310))));
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

// Each place is met in the whole scene, so that of one with thousands of contacts every place costs as much
// as all of a small one, and shows no more.
AcceptedState draw_small_state(Draws& draws) {
  constexpr std::size_t kMostElements = 80;
  for (;;) {
    AcceptedState state = draw_state(draws);
    if (state.scene.faces.size() + state.scene.edges.size() <= kMostElements) return state;
  }
}

Script drawn(std::uint64_t seed) {
  Draws draws(seed);
  Script script{"drawn with seed " + std::to_string(seed), draw_small_state(draws), {}, {}};
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

}  // namespace

std::vector<Script> fault_scripts() {
  std::vector<Script> all{poses_and_positions(),
                          contacts_at_rest(Report::kAll),
                          contacts_at_rest(Report::kCount),
                          contacts_at_rest(Report::kEarliest),
                          falling(),
                          scripts::changes(),
                          scripts::changes_together(),
                          trials(),
                          scripts::filters(),
                          scripts::options(),
                          scripts::replacements(),
                          scripts::replaced_locally(),
                          scripts::replaced_whole(),
                          placed(),
                          exact_numbers(),
                          kinds_of_bounds()};
  for (std::uint64_t seed = 1; seed <= seeds(); ++seed) all.push_back(drawn(seed));
  return all;
}

}  // namespace warmfront::testing

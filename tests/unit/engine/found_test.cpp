// SPDX-License-Identifier: Apache-2.0
// Detected bodies, rigid motion and bounds, and their statistics.
#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "engine/collider.h"
#include "engine/motion/rigid_fit.h"
#include "engine/scene/found_bodies.h"
#include "engine/state/rigid_parts.h"
#include "engine/step/auto_bounds.h"
#include "tests/support/scenes.h"
#include "tests/unit/engine/wavy_sheets.h"

namespace warmfront {
namespace {

using Doubles = std::span<const double>;
using testing::WavySheets;

/// The first sheet has turned as a whole for as long as it takes to be found rigid.
Collider found_rigid(WavySheets& sheets) {
  Collider collider = sheets.collider({});
  for (std::uint32_t step = 0; step < RigidParts::kSteps + 4; ++step) {
    sheets.turn(0, 0.1);
    EXPECT_TRUE(collider.step(Doubles(sheets.x)).ok());
  }
  return collider;
}

TEST(FoundBodies, AreTheComponentsWhereTheyFollowOneAnother) {
  const std::vector<Body> bodies = found_bodies(*WavySheets(3, 8).scene);
  ASSERT_EQ(bodies.size(), 3U);
  for (std::uint32_t b = 0; b < 3; ++b) {
    EXPECT_EQ(bodies[b].first_vertex, 81 * b);
    EXPECT_EQ(bodies[b].vertex_count, 81U);
    EXPECT_EQ(bodies[b].kind, BodyKind::kDeformable);
  }
}

TEST(FoundBodies, ShareARangeWhereTheirVerticesInterleave) {
  WavySheets sheets(3, 8);
  // The last vertex of the first sheet and the first of the second change places.
  for (auto& face : sheets.faces) {
    for (auto& v : face) v = v == 80 ? 81 : v == 81 ? 80 : v;
  }
  const std::vector<Body> bodies = found_bodies(*testing::make_scene(243, sheets.faces));
  ASSERT_EQ(bodies.size(), 2U);
  EXPECT_EQ(bodies[0].vertex_count, 162U);
  EXPECT_EQ(bodies[1].first_vertex, 162U);
}

TEST(FoundBodies, IncludeSmallComponentsAndIsolatedVertices) {
  testing::Faces faces = testing::grid(8);
  const auto last = static_cast<std::int32_t>(83);  // two isolated vertices lie between
  for (auto face : testing::tetrahedron()) faces.push_back({face[0] + last, face[1] + last, face[2] + last});
  EXPECT_TRUE(found_bodies(*testing::make_scene(87, faces)).empty()) << "a single body is not reported";
  for (auto face : testing::grid(8)) faces.push_back({face[0] + 87, face[1] + 87, face[2] + 87});
  const std::vector<Body> bodies = found_bodies(*testing::make_scene(170, faces));  // two more at the end
  ASSERT_EQ(bodies.size(), 2U);
  EXPECT_EQ(bodies[0].vertex_count, 81U);
  EXPECT_EQ(bodies[1].first_vertex + bodies[1].vertex_count, 170U);
}

TEST(FoundRigid, WhatTurnsAsAWholeIsNotTestedAgainstItself) {
  WavySheets sheets(3, 8);
  Collider collider = sheets.collider({});
  StepCounts counts;
  for (std::uint32_t step = 0; step < RigidParts::kSteps + 4; ++step) {
    sheets.turn(0, 0.1);
    sheets.turn(1, -0.2);
    const StepResult result = collider.step(Doubles(sheets.x)).value();
    counts = result.statistics.counts;
    EXPECT_TRUE(result.contacts.empty());
  }
  EXPECT_EQ(counts.parts, 3U);
  EXPECT_EQ(counts.parts_moved, 2U);
  EXPECT_EQ(counts.parts_rigid, 2U);
  EXPECT_EQ(counts.orphan_tests, 0U);
  EXPECT_EQ(counts.near_parts, 1U) << "of all pairs only the sheet at rest, with itself";
}

TEST(FoundRigid, WhatDeformsIsTestedInThatVeryStep) {
  WavySheets sheets(1, 8);
  Collider collider = found_rigid(sheets);
  std::swap_ranges(sheets.x.begin(), sheets.x.begin() + 3, sheets.x.begin() + 3 * 40);  // through the sheet
  const StepResult result = collider.step(Doubles(sheets.x)).value();
  EXPECT_EQ(result.statistics.counts.parts_rigid, 0U);
  EXPECT_FALSE(result.contacts.empty());
}

TEST(FoundRigid, WhatTouchesItselfIsTestedHoweverItMoves) {
  WavySheets sheets(1, 8);
  // A triangle that lies on one of the sheet's.
  for (const int v : {40, 49, 50}) {
    for (int axis = 0; axis < 3; ++axis) sheets.x.push_back(sheets.x[3 * v + axis]);
  }
  sheets.faces.push_back({81, 82, 83});
  sheets.scene = testing::make_scene(84, sheets.faces);
  Collider collider = sheets.collider({});
  for (std::uint32_t step = 0; step < RigidParts::kSteps + 8; ++step) {
    for (std::size_t i = 0; i < sheets.x.size(); i += 3) sheets.x[i] += 0.25;
    const StepResult result = collider.step(Doubles(sheets.x)).value();
    EXPECT_FALSE(result.contacts.empty()) << step;
    EXPECT_EQ(result.statistics.counts.parts_rigid, 0U) << step;
  }
}

TEST(FoundRigid, AHalfTurnInOneStepIsNotTakenForRigid) {
  WavySheets sheets(1, 8);
  Collider collider = found_rigid(sheets);
  sheets.turn(0, std::acos(-1.0));  // every vertex goes through the axis: all of them meet half way
  const StepResult result = collider.step(Doubles(sheets.x)).value();
  EXPECT_EQ(result.statistics.counts.parts_rigid, 0U);
  EXPECT_FALSE(result.contacts.empty());
}

// Questions in which it rests lie between: each begins where the turn ended, not where that began.
TEST(FoundRigid, TwoHalfTurnsAreNotTakenForAWholeOne) {
  WavySheets sheets(1, 8);
  Collider collider = found_rigid(sheets);
  for (int turn = 0; turn < 4; ++turn) {
    sheets.turn(0, std::acos(-1.0));
    const StepResult result = collider.step(Doubles(sheets.x)).value();
    EXPECT_EQ(result.statistics.counts.parts_rigid, 0U) << turn;
    EXPECT_FALSE(result.contacts.empty()) << turn;
    ASSERT_TRUE(collider.trial(Doubles(sheets.x)).ok());
    ASSERT_TRUE(collider.step(Doubles(sheets.x)).ok());
  }
}

// What pierces itself may have no vertex near a face and no edge near another: it never meets itself anew,
// and is tangled all the same.
TEST(FoundRigid, IsAskedAboutItsTanglesToo) {
  std::vector<double> x{-1, -1, 0, 1, -1, 0, 0, 1, 0, 0, -0.2, -0.5, 0.05, -0.3, 0.5, -0.05, -0.3, 0.5};
  const auto scene = testing::make_scene(6, {{0, 1, 2}, {3, 4, 5}});
  const auto workers = std::make_shared<Workers>(1);
  for (const Tier tier : {Tier::kCertified, Tier::kExact}) {
    Collider collider = Collider::create(scene, Doubles(x), {.tier = tier}, workers).value();
    const auto fall = [&x](int times) {
      std::vector<double> y = x;
      for (std::size_t z = 2; z < y.size(); z += 3) y[z] -= 0.125 * times;
      return y;
    };
    std::uint64_t rigid = 0;
    for (int step = 1; step < 24; ++step)
      rigid = collider.step(Doubles(fall(step))).value().statistics.counts.parts_rigid;
    EXPECT_EQ(rigid, 1U) << "else the test shows nothing";
    EXPECT_EQ(collider.intersections().value().ef, 2U);
    for (int ask = 0; ask < 2; ++ask) {
      EXPECT_EQ(collider.trial(Doubles(fall(24))).value().contacts.size(), 0U);
      EXPECT_EQ(collider.intersections(Where::kTrialEnd).value().ef, 2U);
    }
    EXPECT_EQ(collider.step(Doubles(fall(25))).value().contacts.size(), 0U);
    EXPECT_EQ(collider.intersections().value().ef, 2U);
  }
}

// A solver that goes half of each way only: no place that it comes to is one of a body that turned.
TEST(FoundRigid, AlsoBetweenThePlacesOfABodyThatTurns) {
  WavySheets sheets(2, 8);
  Collider collider = sheets.collider({});
  for (std::uint32_t step = 0; step < RigidParts::kSteps + 8; ++step) {
    const std::vector<double> before = sheets.x;
    sheets.turn(0, 0.7);
    sheets.turn(1, -0.4);
    const std::vector<double> after = sheets.x;
    std::vector<std::uint64_t> rigid;
    const auto count = [&](const StepResult& result) {
      rigid.push_back(result.statistics.counts.parts_rigid);
      EXPECT_TRUE(result.contacts.empty());
    };
    std::vector<double> half(before.size());
    for (std::size_t i = 0; i < half.size(); ++i) half[i] = 0.5 * (before[i] + after[i]);
    count(collider.trial(Doubles(half)).value());
    count(collider.trial(Doubles(after)).value());
    ASSERT_TRUE(collider.commit(0.25).ok());
    count(collider.step(Doubles(half)).value());
    count(collider.step(Doubles(after)).value());
    if (step < RigidParts::kSteps) continue;
    EXPECT_EQ(rigid, std::vector<std::uint64_t>(4, 2)) << step;
  }
}

TEST(FoundRigid, CanBePinned) {
  WavySheets sheets(2, 8);
  ColliderOptions options;
  options.find_bodies = options.find_rigid = false;
  options.bounds = BoundsKind::kAabb;
  Collider collider = sheets.collider(options);
  for (std::uint32_t step = 0; step < RigidParts::kSteps + 4; ++step) {
    sheets.turn(0, 0.1);
    const StepStatistics statistics = collider.step(Doubles(sheets.x)).value().statistics;
    EXPECT_EQ(statistics.counts.parts, 1U);
    EXPECT_EQ(statistics.counts.parts_rigid, 0U);
    EXPECT_EQ(statistics.bounds, BoundsKind::kAabb);
  }
}

StepCounts counted(std::uint64_t moved, std::uint64_t tests, std::uint64_t pairs = 0) {
  return {.primitive_tests = tests, .triangle_pairs = pairs, .vertices_moved = moved};
}

// Steps until the trial of bounds changes its choice, or for many steps.
bool changes(BoundsTrial& trial, const StepCounts& counts) {
  for (int step = 0; step < 100; ++step) {
    if (trial.take(counts)) return true;
  }
  return false;
}

TEST(BoundsTrial, IsNotMadeWhereMuchIsTested) {
  BoundsTrial trial;
  EXPECT_FALSE(changes(trial, counted(1000, 2000)));
  EXPECT_FALSE(changes(trial, counted(1000, 0))) << "decided";
  BoundsTrial pairs;
  EXPECT_FALSE(changes(pairs, counted(1000, 0, 200)));
  EXPECT_EQ(pairs.bounds(), BoundsKind::kKDop18);
}

TEST(BoundsTrial, StaysWithAabbsWhereTheyLetHardlyMoreThrough) {
  BoundsTrial hardly;
  ASSERT_TRUE(changes(hardly, counted(1000, 400)));
  EXPECT_EQ(hardly.bounds(), BoundsKind::kAabb);
  EXPECT_FALSE(changes(hardly, counted(1000, 900)));
  EXPECT_EQ(hardly.bounds(), BoundsKind::kAabb);

  BoundsTrial more;
  ASSERT_TRUE(changes(more, counted(1000, 400)));
  ASSERT_TRUE(changes(more, counted(1000, 400, 51)));
  EXPECT_EQ(more.bounds(), BoundsKind::kKDop18);
  EXPECT_FALSE(changes(more, counted(1000, 400))) << "tried once";
}

TEST(BoundsTrial, DoesNotCountColdStepsNorThoseAtRest) {
  BoundsTrial trial;
  for (std::size_t step = 0; step < BoundsTrial::kSettling; ++step)
    EXPECT_FALSE(trial.take(counted(1000, 9000)));
  EXPECT_FALSE(changes(trial, counted(0, 0)));
  EXPECT_TRUE(changes(trial, counted(1000, 10)));
}

// The same frames give the same bounds and counts, step by step, under any load of the machine.
TEST(AutoBounds, CountsFollowFromTheFramesAlone) {
  std::vector<BoundsKind> bounds;
  std::vector<std::uint64_t> tests;
  for (const std::size_t threads : {1, 2, 2}) {
    WavySheets sheets(3, 8);
    Collider collider = Collider::create(sheets.scene, Doubles(sheets.x), {.find_rigid = false},
                                         std::make_shared<Workers>(static_cast<int>(threads)))
                            .value();
    std::vector<BoundsKind> bounds_now;
    std::vector<std::uint64_t> tests_now;
    for (int step = 0; step < 40; ++step) {
      for (std::size_t i = 2; i < sheets.x.size(); i += 3) sheets.x[i] += 1e-3 * std::sin(step + 0.1 * i);
      const StepStatistics statistics = collider.step(Doubles(sheets.x)).value().statistics;
      bounds_now.push_back(statistics.bounds);
      tests_now.push_back(statistics.counts.bv_tests);
      tests_now.push_back(statistics.counts.primitive_tests);
      tests_now.push_back(statistics.counts.triangle_pairs);
    }
    if (!bounds.empty()) {
      EXPECT_EQ(bounds_now, bounds);
      EXPECT_EQ(tests_now, tests);
    }
    bounds = bounds_now;
    tests = tests_now;
  }
}

TEST(Explain, TellsWhatTheAllDeformableStepTakes) {
  WavySheets sheets(2, 8);
  ColliderOptions options;
  options.explain = true;
  Collider collider = sheets.collider(options);
  for (std::uint32_t step = 0; step < RigidParts::kSteps + 4; ++step) {
    sheets.turn(0, 0.1);
    const StepResult result = collider.step(Doubles(sheets.x)).value();
    ASSERT_TRUE(result.all_deformable.has_value());
    EXPECT_EQ(result.all_deformable->counts.parts, 1U);
    if (step > RigidParts::kSteps) {
      EXPECT_GT(result.all_deformable->counts.front_pairs, result.statistics.counts.front_pairs);
    }
  }
  EXPECT_GT(collider.memory_bytes(), sheets.collider({}).memory_bytes());
  EXPECT_FALSE(sheets.collider({}).step(Doubles(sheets.x)).value().all_deformable.has_value());
}

TEST(Explain, IsMadeAnewWhenAStepNeedsItAfterTheSceneHasChanged) {
  const WavySheets sheets(2, 8);
  SceneDescription description{162, {}, {{"left", 0, 81}, {"right", 81, 81}}};
  for (const auto& face : sheets.faces) description.faces.push_back({face[0], face[1], face[2]});
  ColliderOptions options;
  options.explain = true;
  options.bounds = BoundsKind::kKDop18;
  const auto make = [&](SceneDescription of, std::span<const double> positions) {
    return Collider::create(std::make_shared<const Scene>(Scene::create(std::move(of)).value()), positions,
                            options, std::make_shared<Workers>(2))
        .value();
  };
  Collider collider = make(description, sheets.x);
  ASSERT_TRUE(collider.step(Doubles(sheets.x)).ok());
  const std::size_t both = collider.memory_bytes();
  // Several changes before one step cause one comparison collider, not one each.
  Body fixed{"left", 0, 81, BodyKind::kStatic};
  ASSERT_TRUE(collider.change_body(0, fixed).ok());
  EXPECT_LT(collider.memory_bytes(), both);
  const std::vector<double> sheet(sheets.x.begin(), sheets.x.begin() + 243);
  BodyAddition addition{{"new", 0, 81}, {}};
  addition.faces.assign(description.faces.begin(), description.faces.begin() + 128);
  ASSERT_TRUE(collider.add_body(addition, Doubles(sheet)).ok());

  // It has the collider's positions before the step, like one created there.
  description.bodies[0] = fixed;
  description.bodies.push_back({"new", 162, 81});
  description.vertex_count = 243;
  for (auto face : addition.faces) description.faces.push_back({face[0] + 162, face[1] + 162, face[2] + 162});
  std::vector<double> x = sheets.x;
  x.insert(x.end(), sheet.begin(), sheet.end());
  Collider other = make(description, x);
  for (std::size_t i = 486; i < x.size(); ++i) x[i] += 0.25;
  for (int step = 0; step < 2; ++step) {
    const StepResult changed = collider.step(Doubles(x)).value();
    const StepResult made = other.step(Doubles(x)).value();
    ASSERT_TRUE(changed.all_deformable && made.all_deformable);
    EXPECT_EQ(changed.all_deformable->counts.triangle_pairs, made.all_deformable->counts.triangle_pairs);
    if (step == 0) {  // the next one is at rest
      EXPECT_GT(changed.all_deformable->counts.triangle_pairs, 0U);
    }
    EXPECT_EQ(changed.all_deformable->front_state, made.all_deformable->front_state);
  }
}

}  // namespace
}  // namespace warmfront

// SPDX-License-Identifier: Apache-2.0
// Detected bodies, rigid motion and bounds, and their statistics.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include "engine/collider.h"
#include "engine/motion/least_stretch.h"
#include "engine/motion/rigid_fit.h"
#include "engine/scene/found_bodies.h"
#include "engine/state/rigid_parts.h"
#include "engine/step/auto_bounds.h"
#include "tests/support/scenes.h"

namespace warmfront {
namespace {

using Doubles = std::span<const double>;

/// `count` wavy sheets of n x n quads one beside the other.
struct Sheets {
  Sheets(int count, int n) : n(n) {
    for (int s = 0; s < count; ++s) {
      for (auto face : testing::grid(n)) {
        for (auto& v : face) v += s * vertices();
        faces.push_back(face);
      }
      for (int i = 0; i <= n; ++i) {
        for (int j = 0; j <= n; ++j)
          x.insert(x.end(), {4.0 * s + i / 8.0, j / 8.0, 0.05 * std::sin(0.7 * i * j)});
      }
    }
    scene = testing::make_scene(static_cast<std::uint32_t>(x.size() / 3), faces);
  }

  int vertices() const { return (n + 1) * (n + 1); }
  Collider collider(const ColliderOptions& options) const {
    return Collider::create(scene, Doubles(x), options, std::make_shared<Workers>(2)).value();
  }
  // Sheet `s` turns about the z axis.
  void turn(int s, double angle) {
    for (int v = s * vertices(); v < (s + 1) * vertices(); ++v) {
      const double a = x[3 * v];
      const double b = x[3 * v + 1];
      x[3 * v] = std::cos(angle) * a - std::sin(angle) * b;
      x[3 * v + 1] = std::sin(angle) * a + std::cos(angle) * b;
    }
  }

  int n;
  testing::Faces faces;
  std::vector<double> x;
  std::shared_ptr<const Scene> scene;
};

TEST(FoundBodies, AreTheComponentsWhereTheyFollowOneAnother) {
  const std::vector<Body> bodies = found_bodies(*Sheets(3, 8).scene);
  ASSERT_EQ(bodies.size(), 3U);
  for (std::uint32_t b = 0; b < 3; ++b) {
    EXPECT_EQ(bodies[b].first_vertex, 81 * b);
    EXPECT_EQ(bodies[b].vertex_count, 81U);
    EXPECT_EQ(bodies[b].kind, BodyKind::kDeformable);
  }
}

TEST(FoundBodies, ShareARangeWhereTheirVerticesInterleave) {
  Sheets sheets(3, 8);
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

TEST(RigidFit, IsAsGoodAsTheWorstVertex) {
  const Sheets sheets(1, 8);
  std::vector<VertexMotion> vertices(81);
  for (std::size_t v = 0; v < 81; ++v) {
    const double* x = sheets.x.data() + 3 * v;
    vertices[v].t0 = {x[0], x[1], x[2], 0};
    vertices[v].t1 = {-x[1] + 5, x[0] - 7, x[2] + 0.125, 0};  // a quarter turn
  }
  const RigidReference reference(vertices);
  EXPECT_FALSE(reference.flat());
  const RigidReference::Fit there = reference.fit(vertices, true, 1e-3);
  const RigidReference::Fit turned = reference.fit(vertices, false, 1e-3);
  EXPECT_LT(there.residual, 1e-12);
  EXPECT_LT(turned.residual, 1e-12);
  EXPECT_NEAR(cosine_between(there.linear, turned.linear), 0, 1e-12);
  vertices[40].t1[2] += 2e-4;
  EXPECT_NEAR(reference.fit(vertices, false, 1e-3).residual, 2e-4, 1e-9);
  EXPECT_EQ(reference.fit(vertices, false, 1e-4).residual, std::numeric_limits<double>::infinity());
}

TEST(RigidFit, CollinearPointsHaveNoFit) {
  std::vector<VertexMotion> line(9);
  for (std::size_t v = 0; v < line.size(); ++v) line[v].t0 = line[v].t1 = {static_cast<double>(v), 0, 0, 0};
  EXPECT_TRUE(RigidReference(line).flat());
  EXPECT_EQ(RigidReference(line).fit(line, true, 1).residual, std::numeric_limits<double>::infinity());
  std::vector<VertexMotion> tiny(4);
  tiny[1].t0[0] = tiny[2].t0[1] = tiny[3].t0[2] = 1e-170;  // whose squares vanish
  EXPECT_TRUE(RigidReference(tiny).flat());
}

TEST(RigidFit, FindsWhatIsBetweenTwoPlacesOfABody) {
  for (const double height : {0.05, 0.0}) {  // also of what lies in a plane
    std::vector<VertexMotion> vertices(81);
    for (std::size_t v = 0; v < 81; ++v) {
      const double x = static_cast<double>(v / 9) / 8;
      const double y = static_cast<double>(v % 9) / 8;
      const double z = height * std::sin(7 * x * y);
      vertices[v].t0 = {x, y, z, 0};
      // A quarter of the way of a sixth of a turn, with a drift.
      const double turned[2] = {0.5 * x - std::sqrt(0.75) * y, std::sqrt(0.75) * x + 0.5 * y};
      vertices[v].t1 = {0.75 * x + 0.25 * (turned[0] + 3), 0.75 * y + 0.25 * (turned[1] - 2), z + 0.25, 0};
    }
    const RigidReference reference(vertices);
    constexpr double kNone = std::numeric_limits<double>::infinity();
    EXPECT_EQ(reference.fit(vertices, false, 1e-3).residual, kNone);
    const RigidReference::Fit between = reference.fit_between(vertices, false, 1e-3);
    EXPECT_FALSE(between.turned);
    EXPECT_LT(between.residual, 1e-12);
    const LinearMap expected{0.875, -0.25 * std::sqrt(0.75), 0, 0.25 * std::sqrt(0.75), 0.875, 0, 0, 0, 1};
    for (std::size_t k = 0; k < 9; ++k) EXPECT_NEAR(between.linear[k], expected[k], 1e-10) << k;
    vertices[40].t1[2] += 2e-4;
    EXPECT_NEAR(reference.fit_between(vertices, false, 1e-3).residual, 2e-4, 1e-7);
    EXPECT_EQ(reference.fit_between(vertices, false, 1e-4).residual, kNone);
  }
}

LinearMap turn_about_z(double degrees) {
  const double angle = degrees * std::acos(-1.0) / 180;
  return {std::cos(angle), -std::sin(angle), 0, std::sin(angle), std::cos(angle), 0, 0, 0, 1};
}

LinearMap between(const LinearMap& a, const LinearMap& b, double t) {
  LinearMap m;
  for (std::size_t k = 0; k < 9; ++k) m[k] = a[k] + t * (b[k] - a[k]);
  return m;
}

TEST(RemainsSpread, WhatTurnsByLessThanAQuarter) {
  EXPECT_TRUE(remains_spread(turn_about_z(0), turn_about_z(0)));
  EXPECT_TRUE(remains_spread(turn_about_z(20), turn_about_z(109)));
  EXPECT_FALSE(remains_spread(turn_about_z(20), turn_about_z(112)));
  EXPECT_FALSE(remains_spread(turn_about_z(0), turn_about_z(180)));
  const LinearMap half = between(turn_about_z(0), turn_about_z(60), 0.5);
  EXPECT_TRUE(remains_spread(turn_about_z(0), half));
  EXPECT_TRUE(remains_spread(half, turn_about_z(60)));
  EXPECT_TRUE(remains_spread(half, turn_about_z(75)));
  EXPECT_FALSE(remains_spread(half, turn_about_z(150)));
}

TEST(RemainsSpread, NothingThatShrinksStretchesOrMirrors) {
  const LinearMap stays = turn_about_z(0);
  const auto scaled = [](double x, double z) { return LinearMap{x, 0, 0, 0, 1, 0, 0, 0, z}; };
  EXPECT_TRUE(remains_spread(stays, scaled(0.72, 1)));
  EXPECT_FALSE(remains_spread(stays, scaled(0.7, 1)));
  EXPECT_FALSE(remains_spread(scaled(1, 0.7), stays));
  EXPECT_TRUE(remains_spread(stays, scaled(1, 1.49)));
  EXPECT_FALSE(remains_spread(stays, scaled(1, 1.5)));
  EXPECT_FALSE(remains_spread(stays, scaled(1, -1)));
  EXPECT_FALSE(remains_spread(stays, LinearMap{}));
  LinearMap shear = stays;
  shear[1] = 0.8;
  EXPECT_FALSE(remains_spread(stays, shear)) << "it shrinks the diagonal";
  EXPECT_FALSE(remains_spread(stays, scaled(std::numeric_limits<double>::quiet_NaN(), 1)));
  EXPECT_FALSE(remains_spread(stays, scaled(1e300, 1)));
}

// Against the least stretch that is found by looking: never more is claimed.
TEST(RemainsSpread, IsTrueOfWhatItSays) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> uniform(-1, 1);
  int proved = 0;
  for (int run = 0; run < 400; ++run) {
    LinearMap ends[2] = {turn_about_z(90 * uniform(random)), turn_about_z(90 * uniform(random))};
    for (LinearMap& end : ends) {
      for (double& x : end) x += 0.2 * uniform(random);
    }
    if (!remains_spread(ends[0], ends[1])) continue;
    ++proved;
    for (int look = 0; look < 400; ++look) {
      const LinearMap m = between(ends[0], ends[1], 0.5 + 0.5 * uniform(random));
      const double v[3] = {uniform(random), uniform(random), uniform(random)};
      double before = 0;
      double after = 0;
      for (std::size_t row = 0; row < 3; ++row) {
        const double x = m[3 * row] * v[0] + m[3 * row + 1] * v[1] + m[3 * row + 2] * v[2];
        before += v[row] * v[row];
        after += x * x;
      }
      ASSERT_GT(after, kLeastStretch * kLeastStretch * before);
      ASSERT_LT(after, kMostStretch * kMostStretch * before);
    }
  }
  EXPECT_GT(proved, 40);
}

TEST(FoundRigid, WhatTurnsAsAWholeIsNotTestedAgainstItself) {
  Sheets sheets(3, 8);
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
  Sheets sheets(1, 8);
  Collider collider = sheets.collider({});
  for (std::uint32_t step = 0; step < RigidParts::kSteps + 4; ++step) {
    sheets.turn(0, 0.1);
    ASSERT_TRUE(collider.step(Doubles(sheets.x)).ok());
  }
  std::swap_ranges(sheets.x.begin(), sheets.x.begin() + 3, sheets.x.begin() + 3 * 40);  // through the sheet
  const StepResult result = collider.step(Doubles(sheets.x)).value();
  EXPECT_EQ(result.statistics.counts.parts_rigid, 0U);
  EXPECT_FALSE(result.contacts.empty());
}

TEST(FoundRigid, WhatTouchesItselfIsTestedHoweverItMoves) {
  Sheets sheets(1, 8);
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
  Sheets sheets(1, 8);
  Collider collider = sheets.collider({});
  for (std::uint32_t step = 0; step < RigidParts::kSteps + 4; ++step) {
    sheets.turn(0, 0.1);
    ASSERT_TRUE(collider.step(Doubles(sheets.x)).ok());
  }
  sheets.turn(0, std::acos(-1.0));  // every vertex goes through the axis: all of them meet half way
  const StepResult result = collider.step(Doubles(sheets.x)).value();
  EXPECT_EQ(result.statistics.counts.parts_rigid, 0U);
  EXPECT_FALSE(result.contacts.empty());
}

// A solver that goes half of each way only: no place that it comes to is one of a body that turned.
TEST(FoundRigid, AlsoBetweenThePlacesOfABodyThatTurns) {
  Sheets sheets(2, 8);
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
  Sheets sheets(2, 8);
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
    Sheets sheets(3, 8);
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
  Sheets sheets(2, 8);
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
  const Sheets sheets(2, 8);
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

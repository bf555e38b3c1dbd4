// SPDX-License-Identifier: Apache-2.0
// Scenes that need much more work than their number of triangles suggests: their processing checks the stop
// flag at bounded intervals, measured in counts, never in time; and what changes cost.
#include <gtest/gtest.h>

#include <atomic>
#include <cstdio>
#include <memory>
#include <optional>
#include <vector>

#include "engine/bvh/topology.h"
#include "engine/collider.h"
#include "engine/motion/scene_motion.h"
#include "tests/faults/bounded_fixture.h"
#include "tests/support/counted_looks.h"
#include "tests/support/failing_allocations.h"
#include "tests/support/hostile_scenes.h"

namespace warmfront::testing {
namespace {

// Runs `call` with the flag of looks that stop at the n-th, for n spread over all there are, until it is
// done. Returns how many looks that took.
template <class Call>
long stop_at_many_looks(Call&& call) {
  for (long n = 0;; n += 1 + n / 8) {
    const CountedLooks looks(n);
    const auto result = call(CountedLooks::flag());
    if (!CountedLooks::met()) {
      EXPECT_TRUE(result.ok());
      return CountedLooks::count();
    }
    EXPECT_TRUE(!result.ok() && result.error().code == ErrorCode::kCancelled) << "look " << n;
    EXPECT_LE(CountedLooks::count(), n + 2) << "and goes on no further";
  }
}

TEST(Looks, CreatingIsStoppedBetweenAFewThousandFaces) {
  for (const HostileScene& scene : {flat_grid(100), fan(1000), as_body(book(20'000), false)}) {
    const auto shared = std::make_shared<const Scene>(Scene::create(scene.description).value());
    const auto create = [&](const std::atomic<bool>* flag) {
      return Collider::create(shared, Doubles(scene.positions), {}, one_thread(), flag);
    };
    EXPECT_TRUE(create(nullptr).ok());
    const std::size_t before = live_bytes();  // with what the arena keeps of its first
    EXPECT_GT(stop_at_many_looks(create), static_cast<long>(shared->face_count()) / 64);
    EXPECT_EQ(live_bytes(), before);
  }
}

TEST(Looks, OfASceneAreAsManyAsItsFaces) {
  for (const HostileScene& scene : {flat_grid(200), as_body(flat_grid(200), true)}) {
    const auto create = [&](const std::atomic<bool>* flag) -> Result<Scene> {
      try {
        return Scene::create(scene.description, StopSignal(flag));
      } catch (const Stopped&) {
        return Error{ErrorCode::kCancelled, ""};
      }
    };
    const std::size_t before = live_bytes();
    EXPECT_GT(stop_at_many_looks(create), static_cast<long>(scene.description.faces.size()) / 300);
    EXPECT_EQ(live_bytes(), before);
  }
}

// A frame's first stages: it is checked, and applied.
TEST(Looks, OfAFrameThatBeginsAreAsManyAsItsVertices) {
  const HostileScene scene = as_body(flat_grid(300), false);
  const Scene made = Scene::create(scene.description).value();
  const auto pieces = static_cast<long>(made.vertex_count() / 8192);
  std::optional<SceneMotion> motion;
  const auto looks_of = [&](auto&& work) {
    const CountedLooks looks(-1);
    one_thread()->run([&] { work(StopSignal(CountedLooks::flag())); });
    return CountedLooks::count();
  };
  EXPECT_GE(looks_of([&](StopSignal stop) { motion.emplace(made, scene.positions, stop); }), pieces);
  std::optional<Topology> topology;
  one_thread()->run([&] { topology.emplace(made, motion->vertices(), 8, false); });
  EXPECT_GE(looks_of([&](StopSignal stop) { motion->renumber(topology->numbering, 0, stop); }), pieces / 4);
  std::vector<double> moved = scene.positions;
  for (double& x : moved) x += 1;
  const Frame frame{Doubles(moved)};
  EXPECT_GE(looks_of([&](StopSignal stop) { EXPECT_TRUE(motion->check(made, frame, stop).ok()); }),
            pieces / 2);
  EXPECT_GE(looks_of([&](StopSignal stop) {
              SceneMotion::Step step(*motion);
              step.begin(frame, stop);
            }),
            pieces);
  EXPECT_EQ(motion->positions(), scene.positions) << "which was not committed";
  for (long n = 0; n < pieces; ++n) {
    const CountedLooks looks(n);
    SceneMotion::Step step(*motion);
    EXPECT_THROW(one_thread()->run([&] { step.begin(frame, StopSignal(CountedLooks::flag())); }), Stopped);
  }
  EXPECT_EQ(motion->positions(), scene.positions) << "and wherever it was stopped";
}

// Every kind of call except create() and step(), which other tests stop: the collider is unchanged.
TEST(Looks, ChangesAndChecksThatAreStoppedDidNotHappen) {
  const HostileScene scene = stacked_sheets(8, 16, BodyKind::kDeformable);
  Collider collider = make(scene, {});
  Collider control = make(scene, {});
  const std::vector<double> apart = spread(scene);
  const auto expect_alike = [&] {
    for (const auto* frame : {&apart, &scene.positions}) {
      for (Collider* one : {&collider, &control}) {
        std::vector<double> positions = *frame;
        positions.resize(std::size_t{3} * one->scene().vertex_count(), 0.5);
        ASSERT_TRUE(one->step(Doubles(positions)).ok());
      }
      EXPECT_EQ(collider.positions(), control.positions());
      EXPECT_TRUE(collider.self_check().ok());
    }
  };
  expect_alike();
  EXPECT_GT(stop_at_many_looks([&](const std::atomic<bool>* flag) { return collider.self_check(flag); }), 20);
  expect_alike();

  Body body = scene.description.bodies[3];
  body.self_collision = false;
  ASSERT_TRUE(collider.change_body(3, body).ok());
  ASSERT_TRUE(control.change_body(3, body).ok());
  body.self_collision = true;
  EXPECT_GT(
      stop_at_many_looks([&](const std::atomic<bool>* flag) { return collider.change_body(3, body, flag); }),
      0);
  ASSERT_TRUE(control.change_body(3, body).ok());
  expect_alike();

  const HostileScene added = flat_grid(16);
  BodyAddition addition;
  addition.body.vertex_count = added.description.vertex_count;
  addition.faces = added.description.faces;
  EXPECT_GT(stop_at_many_looks([&](const std::atomic<bool>* flag) {
              return collider.add_body(addition, Doubles(added.positions), flag);
            }),
            10);
  ASSERT_TRUE(control.add_body(addition, Doubles(added.positions)).ok());
  EXPECT_EQ(collider.scene().body_count(), 9U);
  expect_alike();
}

// Between two looks a step runs a block of tests, or some thousands of cheaper operations.
TEST(Looks, OfAStepAreAsManyAsItsWorkAsksFor) {
  for (const Report report : {Report::kCount, Report::kAll, Report::kEarliest}) {
    for (const HostileScene& scene : {collapsed_grid(400), stacked_sheets(100, 1, BodyKind::kRigid)}) {
      Collider collider = make(scene, {.report = report});
      for (int step = 0; step < 2; ++step) {
        const CountedLooks looks(-1);
        const StepResult result = collider.step(Doubles(scene.positions), CountedLooks::flag()).value();
        const StepCounts& counts = result.statistics.counts;
        EXPECT_GE(512 * CountedLooks::count(),
                  static_cast<long>(counts.elementary_tests + counts.orphan_tests));
        EXPECT_GE(4096 * CountedLooks::count(), static_cast<long>(counts.bv_tests + counts.primitive_tests));
        EXPECT_GE(1024 * CountedLooks::count(), static_cast<long>(counts.near_parts));
        EXPECT_GE((1L << 16) * CountedLooks::count(), static_cast<long>(result.contacts.size()));
      }
    }
  }
}

// Found by fuzzing recordings: a separation far below the coordinates' grid needs integers of thousands of
// bits, and a block of such pairs took seconds.
TEST(Looks, OfPairsThatOnlyLongIntegersDecideAreAsManyAsThese) {
  const HostileScene scene = stacked_sheets(2, 4, BodyKind::kDeformable);
  std::vector<double> through = scene.positions;
  for (std::size_t i = through.size() / 2; i < through.size(); i += 3) {
    through[i] += 0.0625 - static_cast<double>(i) / 4096;
    through[i + 2] -= 0.125 + static_cast<double>(i * i % 97) / 512;
  }
  Collider collider = make(scene, {.tier = Tier::kExact, .min_separation = 0x1p-1043});
  const CountedLooks looks(-1);
  const StepResult result = collider.step(Doubles(through), CountedLooks::flag()).value();
  EXPECT_GT(result.statistics.counts.exact_tests, 50U);
  EXPECT_GE(looks.count(), static_cast<long>(result.statistics.counts.exact_tests));
}

// The O(scene) work is done once, however many bodies are added.
TEST(Changes, OfManyBodiesAreOneScene) {
  const HostileScene scene = as_body(flat_grid(200), false);
  constexpr long kBodies = 100;
  AddBody add;
  add.addition.body.vertex_count = 3;
  add.addition.faces = {{0, 1, 2}};
  add.positions = {0, 0, 5, 1, 0, 5, 0, 1, 5};
  const auto looks_of = [&](long bodies) {
    Collider collider = make(scene, {});
    const CountedLooks looks(-1);
    EXPECT_TRUE(collider.change(std::vector<SceneChange>(bodies, add), CountedLooks::flag()).ok());
    EXPECT_EQ(collider.scene().body_count(), 1 + bodies);
    EXPECT_TRUE(collider.self_check().ok());
    return CountedLooks::count();
  };
  const long one = looks_of(1), many = looks_of(kBodies);
  std::printf("%ld looks for one body, %ld for %ld\n", one, many, kBodies);
  constexpr long kForABody = 200;
  EXPECT_LT(many, one + kForABody * kBodies) << "272 for each body, when each made a scene";
}

// A changed description of a body costs as much as the body needs, and nothing that grows with the others.
TEST(Changes, OfOneBodyTakeNothingForTheOthers) {
  const HostileScene scene = stacked_sheets(100, 10, BodyKind::kDeformable);  // 20,000 triangles
  Collider collider = make(scene, {});
  ASSERT_TRUE(collider.step(Doubles(scene.positions)).ok());
  Body body = collider.scene().bodies()[50];
  const auto change = [&] {
    const std::size_t before = live_bytes();
    forget_most_live_bytes();
    const CountedLooks looks(-1);
    EXPECT_TRUE(collider.change_body(50, body, CountedLooks::flag()).ok());
    EXPECT_LE(CountedLooks::count(), 8);
    return most_live_bytes() - before;
  };
  const std::shared_ptr<const Scene> kept = collider.shared_scene();
  change();
  EXPECT_EQ(collider.shared_scene(), kept) << "unchanged: nothing was rebuilt";
  body.name = "renamed";
  EXPECT_LT(change(), 32U << 10);
  body.mask = 3;
  EXPECT_LT(change(), 64U << 10) << "6 MB when each change copied the scene";
  body.self_collision = false;
  EXPECT_LT(change(), 64U << 10);
  EXPECT_TRUE(collider.self_check().ok());
  EXPECT_EQ(kept->bodies()[50].name, "") << "a caller's copy of the scene is unchanged";
  EXPECT_EQ(collider.scene().faces().data(), kept->faces().data()) << "the mesh is shared";
}

}  // namespace
}  // namespace warmfront::testing

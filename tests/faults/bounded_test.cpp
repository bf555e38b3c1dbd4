// SPDX-License-Identifier: Apache-2.0
// Scenes that need much more work than their number of triangles suggests take bounded memory, and their
// processing checks the stop flag at bounded intervals: measured in bytes and counts, never in time.
#include <gtest/gtest.h>

#include <cstdio>
#include <memory>
#include <optional>
#include <string>
#include <tuple>
#include <vector>

#include "engine/bvh/topology.h"
#include "engine/collider.h"
#include "engine/motion/scene_motion.h"
#include "engine/scene/adjacency.h"
#include "tests/support/counted_looks.h"
#include "tests/support/failing_allocations.h"
#include "tests/support/hostile_scenes.h"

namespace warmfront::testing {
namespace {

using Doubles = std::span<const double>;

const std::shared_ptr<Workers>& one_thread() {
  static const auto workers = std::make_shared<Workers>(1);
  return workers;
}

Collider make(const HostileScene& scene, const ColliderOptions& options) {
  auto shared = std::make_shared<const Scene>(Scene::create(scene.description).value());
  return Collider::create(shared, Doubles(scene.positions), options, one_thread()).value();
}

// Sheets of n x n quads, one above the other along (1, 2, 3), which is no axis of bounds: these overlap, and
// the sheets do not. The last two are at the same place.
HostileScene stacked_sheets(int bodies, int n, BodyKind kind) {
  HostileScene scene;
  const auto corners = static_cast<std::uint32_t>((n + 1) * (n + 1));
  for (int b = 0; b < bodies; ++b) {
    for (const auto& face : flat_grid(n).description.faces) {
      auto& added = scene.description.faces.emplace_back(face);
      for (auto& v : added) v += b * static_cast<int>(corners);
    }
    scene.description.bodies.push_back({"", b * corners, corners, kind});
    const double off = (b + 1 == bodies ? b - 1 : b) / 16384.0;
    for (int i = 0; i <= n; ++i) {
      for (int j = 0; j <= n; ++j)
        scene.positions.insert(scene.positions.end(),
                               {off + (2.0 * i + 3.0 * j) / n, 2 * off - 1.0 * i / n, 3 * off - 1.0 * j / n});
    }
  }
  scene.description.vertex_count = bodies * corners;
  return scene;
}

// The same, side by side.
std::vector<double> spread(const HostileScene& scene) {
  std::vector<double> positions = scene.positions;
  for (const Body& body : scene.description.bodies) {
    for (std::uint32_t v = 0; v < body.vertex_count; ++v)
      positions[3 * (body.first_vertex + v) + 2] += 4.0 * body.first_vertex / body.vertex_count;
  }
  return positions;
}

// Pairs of parts for which the front has no room are taken in blocks: with the answer of a front that has it.
class CoincidentParts : public ::testing::TestWithParam<BodyKind> {};
INSTANTIATE_TEST_SUITE_P(Kinds, CoincidentParts, ::testing::Values(BodyKind::kDeformable, BodyKind::kRigid));

TEST_P(CoincidentParts, InBlocksTheAnswerIsTheSame) {
  // Of several blocks each, so that a warm front lists neighbours.
  const HostileScene scene = stacked_sheets(380, 4, GetParam());
  const std::vector<double> apart = spread(scene);
  for (const BoundsKind bounds : {BoundsKind::kAabb, BoundsKind::kKDop18}) {
    const ColliderOptions whole{.bounds = bounds};
    ColliderOptions blocks = whole;
    blocks.max_front_bytes = 20U << 20;
    Collider expected = make(scene, whole);
    Collider collider = make(scene, blocks);
    const std::vector<double>* const frames[] = {&scene.positions, &apart, &apart, &apart, &scene.positions};
    for (std::size_t k = 0; k < std::size(frames); ++k) {
      SCOPED_TRACE("frame " + std::to_string(k));
      const StepResult want = expected.step(Doubles(*frames[k])).value();
      const StepResult got = collider.step(Doubles(*frames[k])).value();
      ASSERT_EQ(std::vector<Contact>(got.contacts.begin(), got.contacts.end()),
                std::vector<Contact>(want.contacts.begin(), want.contacts.end()));
      ASSERT_EQ(got.statistics.counts.triangle_pairs, want.statistics.counts.triangle_pairs);
      const bool near = k == 0 || k == 1 || k > 3;
      if (near) {
        EXPECT_GT(got.contacts.size(), 0U);
        EXPECT_GT(got.statistics.counts.near_parts, 70'000U);
        EXPECT_EQ(got.statistics.counts.near_parts, want.statistics.counts.near_parts);
      }
      EXPECT_EQ(got.statistics.front_state == FrontState::kCapped, near) << "and only then";
      const Status sound = collider.self_check();
      EXPECT_TRUE(sound.ok()) << sound.error().message;
    }
  }
}

TEST_P(CoincidentParts, TheirPairsTakeBoundedMemory) {
  const HostileScene scene = stacked_sheets(900, 1, GetParam());  // 400,000 pairs
  Collider collider = make(scene, {.report = Report::kCount, .max_front_bytes = 1U << 20});
  const std::size_t before = live_bytes();
  forget_most_live_bytes();
  const StepResult step = collider.step(Doubles(scene.positions)).value();
  EXPECT_GT(step.statistics.counts.near_parts, 400'000U);
  EXPECT_LT(most_live_bytes() - before, 40U << 20) << "100 MB before they were taken in blocks";
  EXPECT_LE(live_bytes(), collider.memory_bytes() + (16U << 20)) << "what is held is counted";
}

// ---- hub vertices ----

HostileScene as_body(HostileScene scene, bool self_collision) {
  scene.description.bodies = {{"", 0, scene.description.vertex_count}};
  scene.description.bodies[0].self_collision = self_collision;
  return scene;
}

// Every face around a hub is adjacent to every other: the scene is refused before their pairs are listed.
TEST(Hubs, AreRefusedBeforeTheirPairsAreListed) {
  for (const HostileScene& scene : {fan(2001), fan(9990), book(2001), as_body(fan(9990), true)}) {
    const auto shared = std::make_shared<const Scene>(Scene::create(scene.description).value());
    const std::size_t before = live_bytes();
    forget_most_live_bytes();
    const auto refused = Collider::create(shared, Doubles(scene.positions), {}, one_thread());
    ASSERT_FALSE(refused.ok());
    EXPECT_EQ(refused.error().code, ErrorCode::kResourceExhausted);
    EXPECT_NE(refused.error().message.find("vertex 0 alone is in"), std::string::npos)
        << refused.error().message;
    EXPECT_LT(most_live_bytes() - before, 4096U);
  }
}

TEST(Hubs, OfBodiesThatAreNotTestedAgainstThemselvesTakeTheRoomOfTheirFaces) {
  for (const HostileScene& scene : {as_body(fan(50'000), false), as_body(book(50'000), false)}) {
    const std::size_t before = live_bytes();
    forget_most_live_bytes();
    Collider collider = make(scene, {});
    ASSERT_TRUE(collider.step(Doubles(scene.positions)).ok());
    EXPECT_LT(most_live_bytes() - before, 100U << 20);
    Body body = scene.description.bodies[0];
    body.self_collision = true;
    const Status refused = collider.change_body(0, body);
    ASSERT_FALSE(refused.ok());
    EXPECT_EQ(refused.error().code, ErrorCode::kResourceExhausted);
    EXPECT_FALSE(collider.scene().bodies()[0].self_collision);
    ASSERT_TRUE(collider.step(Doubles(scene.positions)).ok()) << "as before";
  }
}

TEST(Hubs, ThatAreTakenHaveTheirPairsOnce) {
  const HostileScene scene = fan(1000);
  const std::size_t before = live_bytes();
  forget_most_live_bytes();
  Collider collider = make(scene, {});
  EXPECT_LT(most_live_bytes() - before, 48U << 20) << "2.5 million pairs of features";
  const StepResult step = collider.step(Doubles(scene.positions)).value();
  EXPECT_EQ(step.statistics.counts.adjacent_pairs, 1000U * 999 / 2);
  EXPECT_GT(step.statistics.counts.orphan_tests, 1'000'000U);
}

TEST(Hubs, PairsOfPagesOfABookAreCountedOnce) {
  const HostileScene scene = book(30'000);
  EXPECT_EQ(count_adjacent_pairs(Scene::create(scene.description).value()), 30'000ULL * 29'999 / 2);
}

// ---- looks at the stop flag ----

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
    EXPECT_GT(stop_at_many_looks(create), static_cast<long>(shared->face_count()) / 64);
    const std::size_t before = live_bytes();  // with what the arena keeps of its first
    stop_at_many_looks(create);
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

// ---- changes ----

// The O(scene) work is done once, however many bodies are added.
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

// Steps, trials of a line search, max_step() and commits of a scene that has been asked all of them.
TEST(WarmQuestions, AllocateNothing) {
  const HostileScene scene = stacked_sheets(3, 8, BodyKind::kDeformable);
  // Looking for bodies that move rigidly, and trying other bounds, takes memory now and then.
  Collider collider =
      make(scene, {.min_separation = 1e-3, .bounds = BoundsKind::kKDop18, .find_rigid = false});
  const std::vector<double>& x = scene.positions;
  std::vector<double> y = spread(scene);
  std::vector<double> half(x.size());
  std::size_t contacts = 0;
  for (int k = 0; k < 12; ++k) {
    y[7] += 1e-3;
    for (std::size_t i = 0; i < x.size(); ++i) half[i] = 0.5 * (x[i] + y[i]);
    const bool warm = k >= 8;
    const FailingAllocations failing(warm ? 0 : -1);
    const auto ask = [&](const char* what, auto&& question) {
      const auto answer = question();
      ASSERT_TRUE(answer.ok()) << what << ", round " << k;
      ASSERT_FALSE(warm && FailingAllocations::met()) << what << " allocates in round " << k;
    };
    ask("trial", [&] { return collider.trial(Doubles(y)); });
    ask("a shorter trial", [&] { return collider.trial(Doubles(half)); });
    ask("max_step", [&] { return collider.max_step(Doubles(y)); });
    ask("trial of what max_step saw", [&] { return collider.trial(Doubles(half)); });
    ask("reduced proximity", [&] { return collider.proximity(1e-3, Where::kTrialEnd, {.reduced = true}); });
    ask("commit", [&] { return collider.commit(1); });
    ask("step", [&] {
      auto answer = collider.step(Doubles(x));
      contacts += answer.ok() ? answer.value().contacts.size() : 0;
      return answer;
    });
  }
  EXPECT_GT(contacts, 100u);
}

// As long as nothing else is asked, the bounds that pairs need to keep their distances stay as they are.
TEST(WarmQuestions, ThatKeepDistancesAllocateNothing) {
  HostileScene scene = stacked_sheets(3, 8, BodyKind::kDeformable);
  std::vector<double> y = scene.positions;
  scene.positions = spread(scene);  // from where all come together
  Collider collider = make(scene, {.bounds = BoundsKind::kKDop18, .find_rigid = false});
  int cut_short = 0;
  for (int k = 0; k < 12; ++k) {
    y[7] += 1e-3;
    const bool warm = k >= 4;
    for (const double share : {0.5, 0.25}) {
      const FailingAllocations failing(warm ? 0 : -1);
      const auto far = collider.max_step(Doubles(y), true, {.keep_distance = share});
      ASSERT_TRUE(far.ok());
      ASSERT_FALSE(warm && FailingAllocations::met()) << "allocates in round " << k;
      cut_short += far.value().fraction < 1 ? 1 : 0;
    }
  }
  EXPECT_GT(cut_short, 0);
}

// What a session is charged is no less than what the allocator holds for it, and not half as much again.
class Charged : public ::testing::TestWithParam<std::tuple<int, BodyKind, ColliderOptions>> {
 protected:
  /// After steps, trials and commits.
  void expect_enough() {
    const auto& [bodies, kind, options] = GetParam();
    HostileScene scene = stacked_sheets(bodies, bodies > 100 ? 1 : 8, kind);
    for (std::uint32_t b = 0; b < scene.description.bodies.size(); ++b)
      for (std::uint32_t other = b + 5; other < scene.description.bodies.size(); other += 2)
        scene.description.excluded_pairs.push_back({b, other});
    std::optional<Collider> collider = make(scene, options);
    for (int step = 0; step < 8; ++step) {
      for (std::size_t v = 0; v < scene.positions.size(); v += 3) {
        if (kind == BodyKind::kDeformable) scene.positions[v] += 1e-4 * static_cast<double>((v + step) % 7);
      }
      const Doubles positions(scene.positions);
      if (step % 2 == 0) {
        ASSERT_TRUE(collider->trial(positions).ok());
        ASSERT_TRUE(collider->commit(0.5).ok());
      }
      ASSERT_TRUE(collider->step(positions).ok());
    }
    const std::size_t said = collider->memory_bytes(), with = live_bytes();
    collider.reset();
    const std::size_t held = with - live_bytes();
    std::printf("%zu bytes are held, and %zu charged\n", held, said);
    EXPECT_GE(said, held);
    EXPECT_LE(said, held + held / 2 + (std::size_t{32} << 10));
  }
};

TEST_P(Charged, AtLeastWhatTheAllocatorHolds) {
  expect_enough();
}

std::vector<ColliderOptions> of_many_kinds() {
  std::vector<ColliderOptions> all(6);
  all[1].min_separation = 1e-3;
  all[1].leaf_size = 1;
  all[2].bounds = BoundsKind::kAabb;
  all[2].front = FrontMode::kPaper;
  all[3].front = FrontMode::kNone;
  all[3].min_separation = 1e-3;
  all[4].explain = true;
  all[4].fields = {true, true, true};
  all[5].normal_cones = true;
  return all;
}
INSTANTIATE_TEST_SUITE_P(Scenes, Charged,
                         ::testing::Combine(::testing::Values(1, 20, 300),
                                            ::testing::Values(BodyKind::kDeformable, BodyKind::kStatic,
                                                              BodyKind::kRigid),
                                            ::testing::ValuesIn(of_many_kinds())),
                         [](const auto& of) { return "_" + std::to_string(of.index); });

}  // namespace
}  // namespace warmfront::testing

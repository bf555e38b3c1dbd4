// SPDX-License-Identifier: Apache-2.0
// Scenes that need much more work than their number of triangles suggests take bounded memory, of which no
// more is held than charged, and warm questions none.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <iterator>
#include <memory>
#include <optional>
#include <string>
#include <tuple>
#include <vector>

#include "engine/collider.h"
#include "engine/scene/adjacency.h"
#include "tests/faults/bounded_fixture.h"
#include "tests/support/failing_allocations.h"
#include "tests/support/hostile_scenes.h"

namespace warmfront::testing {
namespace {

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

// Where bodies that turn are in the pieces of a step: held where there is room, with the same answer where
// not.
TEST(TurningBodies, HoldTheirPositionsWhereThereIsRoom) {
  constexpr int kSide = 12;
  HostileScene scene = stacked_sheets(2, kSide, BodyKind::kRigid);
  for (Body& body : scene.description.bodies) body.screw = true;
  const auto turned = [](double angle) {
    Pose pose;
    pose.matrix[0] = pose.matrix[5] = std::cos(angle);
    pose.matrix[4] = std::sin(angle);
    pose.matrix[1] = -pose.matrix[4];
    return pose;
  };
  const BodyPose there[] = {{0, turned(1)}, {1, turned(-2)}};
  const BodyPose back[] = {{0, Pose{}}, {1, Pose{}}};
  const std::size_t held = std::size_t{(kSide + 1) * (kSide + 1)} * 17 * 32;  // of one, in 16 pieces
  std::vector<Contact> contacts[2];
  std::size_t most[3] = {};
  for (const std::size_t room : {std::size_t{1} << 30, 4 * held, std::size_t{1}}) {
    Collider collider = make(scene, {.max_front_bytes = room});
    std::size_t k = 0;
    for (const std::span<const BodyPose> step : {std::span(there), std::span(back)}) {
      Frame frame;
      frame.poses = step;
      const StepResult answer = collider.step(frame).value();
      const std::vector<Contact> found(answer.contacts.begin(), answer.contacts.end());
      EXPECT_GT(found.size(), 0U);
      if (contacts[k].empty()) contacts[k] = found;
      EXPECT_EQ(found, contacts[k]) << "step " << k << " with room for " << room;
      ++k;
    }
    most[room == 1 ? 2 : room == 4 * held ? 1 : 0] = collider.memory_bytes();
  }
  EXPECT_GT(most[0], most[1] + held * 9 / 10);
  EXPECT_GT(most[1], most[2] + held * 9 / 10);
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
                         [](const auto& of) { return std::string("_").append(std::to_string(of.index)); });

}  // namespace
}  // namespace warmfront::testing

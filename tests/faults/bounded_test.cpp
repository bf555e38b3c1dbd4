// SPDX-License-Identifier: Apache-2.0
// Scenes that ask for much more work than they have triangles take bounded memory, and what works through
// them looks at the stop flag again and again: by bytes and counts, never by time.
#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <vector>

#include "engine/collider.h"
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

// Every face around a hub is adjacent to every other: what would list their pairs is refused before it does.
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

}  // namespace
}  // namespace warmfront::testing

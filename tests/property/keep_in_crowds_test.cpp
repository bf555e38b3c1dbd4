// SPDX-License-Identifier: Apache-2.0
// How far a crowd may go before a pair comes nearer than a share of its own distance, where it moves by many
// of its bodies' sizes: against every pair of features of two bodies, asked one by one.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <memory>
#include <vector>

#include "engine/collider.h"
#include "engine/elementary/keep_distance.h"
#include "tests/support/brute_force.h"
#include "tests/support/draws.h"
#include "tests/support/scenes.h"
#include "tests/support/workers.h"

namespace warmfront {
namespace {

using testing::Draws;

// Small tetrahedra, some of them in worlds, each of which goes its own way as a whole, but for a little.
struct Crowd {
  static constexpr std::uint32_t kBodies = 27;
  static constexpr std::uint32_t kVertices = 4;

  explicit Crowd(Draws& draws) {
    const bool worlds = draws.below(3) == 0;
    const double apart = std::array{1.5, 3.0}[draws.below(2)];
    const double way = std::array{0.01, 2.0, 30.0, 300.0}[draws.below(4)];
    const bool together = draws.below(4) == 0;
    const std::array<double, 3> common{way * draws.uniform(1), way * draws.uniform(1), way};
    for (std::uint32_t b = 0; b < kBodies; ++b) {
      const auto first = static_cast<std::int32_t>(b * kVertices);
      for (const auto& [i, j, k] : testing::tetrahedron())
        scene.faces.push_back({i + first, j + first, k + first});
      scene.bodies.push_back({"", b * kVertices, kVertices, BodyKind::kDeformable});
      if (worlds) scene.bodies.back().world = draws.below(3);
      const std::array<double, 3> at{apart * (b % 3), apart * (b / 3 % 3), apart * (b / 9)};
      std::array<double, 3> goes;
      for (std::size_t k = 0; k < 3; ++k) goes[k] = together ? common[k] : way * draws.uniform(1);
      for (std::uint32_t v = 0; v < kVertices; ++v) {
        for (std::uint32_t k = 0; k < 3; ++k) {
          const double start = at[k] + (v == k + 1 ? 1 : 0) + 0.1 * draws.uniform(1);
          x.push_back(start);
          next.push_back(start + goes[k] + 0.01 * draws.uniform(1));
        }
      }
    }
    scene.vertex_count = kBodies * kVertices;
  }
  bool may_meet(std::uint32_t a, std::uint32_t b) const {
    const std::uint32_t of_a = scene.bodies[a].world, of_b = scene.bodies[b].world;
    return a != b && (of_a == 0 || of_b == 0 || of_a == of_b);
  }

  SceneDescription scene;
  std::vector<double> x;
  std::vector<double> next;
};

// A commit's room for roundings is beside it.
TEST(KeepDistance, OfCrowdsIsThatOfAllPairsOneByOne) {
  int cut_short = 0, whole = 0;
  for (std::uint64_t seed = 1; seed <= 150; ++seed) {
    Draws draws(seed);
    Crowd crowd(draws);
    for (Body& body : crowd.scene.bodies) body.self_collision = false;
    const double share = std::array{0.1, 0.5, 0.9}[draws.below(3)];
    SCOPED_TRACE("seed " + std::to_string(seed) + ", share " + std::to_string(share));
    const auto scene = std::make_shared<const Scene>(Scene::create(crowd.scene).value());
    Collider collider =
        Collider::create(scene, std::span<const double>(crowd.x), {}, testing::workers()).value();
    const auto vertices = testing::motion_between(crowd.x, crowd.next);
    double least = 1;
    testing::for_all_pairs(*scene, false, [&](ContactKind kind, std::uint32_t a, std::uint32_t b) {
      const FeatureVertices features = testing::features_of(*scene, vertices, kind, a, b);
      const auto body_of = [&](std::size_t k) {
        return static_cast<std::uint32_t>(features.vertex[k] - vertices.data()) / Crowd::kVertices;
      };
      if (!crowd.may_meet(body_of(0), body_of(3))) return;
      const Verdict verdict = keep_distance_test(features, {share, 0}, {});
      if (verdict.contact) least = std::min(least, verdict.toi);
    });
    const MaxStep far =
        collider.max_step(std::span<const double>(crowd.next), false, {.keep_distance = share}).value();
    ASSERT_NEAR(far.fraction, least, 1e-5 * least);
    (far.fraction == 1 ? whole : cut_short) += 1;
  }
  EXPECT_GT(cut_short, 60);
  EXPECT_GT(whole, 15);
}

}  // namespace
}  // namespace warmfront

// SPDX-License-Identifier: Apache-2.0
// How far bodies may go along screws before a pair comes nearer than a share of its own distance, and before
// anything touches: against every pair of their features, asked one by one.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <vector>

#include "engine/collider.h"
#include "tests/property/turning_case.h"
#include "tests/support/brute_force.h"
#include "tests/support/draws.h"
#include "tests/support/scenes.h"
#include "tests/support/screw_oracle.h"
#include "tests/support/workers.h"

namespace warmfront {
namespace {

using testing::Draws;
using testing::Mover;

// Octahedra in a row that turn, each about an axis of its own, and go somewhere.
struct Row {
  static constexpr std::size_t kBodies = 4;
  static constexpr std::size_t kVertices = 6;

  explicit Row(Draws& draws) {
    const double gap = std::array{0.01, 0.2, 1.0}[draws.below(3)];
    const double way = std::array{0.05, 0.5, 4.0}[draws.below(3)];
    const double turn = std::array{0.02, 1.0, 2.5}[draws.below(3)];
    for (std::size_t b = 0; b < kBodies; ++b) {
      const auto first = static_cast<std::int32_t>(b * kVertices);
      for (const auto& [i, j, k] : testing::octahedron())
        scene.faces.push_back({i + first, j + first, k + first});
      scene.bodies.push_back({"", static_cast<std::uint32_t>(first), kVertices, BodyKind::kRigid});
      scene.bodies.back().screw = draws.below(4) != 0;
      const double middle = static_cast<double>(b) * (2 + gap);
      for (const double side : {1.0, -1.0}) {
        for (const int axis : {0, 1, 2})
          for (const int k : {0, 1, 2}) x.push_back((k == axis ? side : 0) + (k == 0 ? middle : 0));
      }
      if (draws.below(5) == 0) continue;  // it rests
      poses.push_back({static_cast<std::uint32_t>(b), turned(draws, middle, turn * draws.uniform(1), way)});
    }
    scene.vertex_count = kBodies * kVertices;
  }
  // About an axis through the middle of a body.
  static Pose turned(Draws& draws, double middle, double angle, double way) {
    Pose pose = testing::drawn_pose(draws, angle, way);
    for (std::size_t i = 0; i < 3; ++i)
      pose.matrix[4 * i + 3] += (i == 0 ? middle : 0) - pose.matrix[4 * i] * middle;
    return pose;
  }
  Frame frame() const {
    Frame frame;
    frame.poses = poses;
    return frame;
  }
  // Of each body.
  std::vector<Mover> movers() const {
    std::vector<Pose> to(kBodies);
    for (const BodyPose& pose : poses) to[pose.body] = pose.pose;
    std::vector<Mover> movers;
    for (std::size_t b = 0; b < kBodies; ++b) movers.emplace_back(Pose{}, to[b], scene.bodies[b].screw);
    return movers;
  }

  SceneDescription scene;
  std::vector<double> x;
  std::vector<BodyPose> poses;
};

// The least time that any pair answers.
double one_by_one(const Scene& scene, const Row& row, double share) {
  const std::vector<Mover> movers = row.movers();
  std::vector<VertexMotion> vertices;
  for (std::size_t v = 0; v < scene.vertex_count(); ++v)
    vertices.push_back(movers[v / Row::kVertices].motion({row.x[3 * v], row.x[3 * v + 1], row.x[3 * v + 2]}));
  double least = 1;
  testing::for_all_pairs(scene, false, [&](ContactKind kind, std::uint32_t a, std::uint32_t b) {
    const FeatureVertices features = testing::features_of(scene, vertices, kind, a, b);
    const auto mover_of = [&](std::size_t k) -> const Mover& {
      return movers[static_cast<std::size_t>(features.vertex[k] - vertices.data()) / Row::kVertices];
    };
    const Mover& first = mover_of(0);
    const Mover& second = mover_of(3);
    if (&first == &second) return;
    const TurningPair pair{features, first.screw ? &first.twist : nullptr,
                           second.screw ? &second.twist : nullptr};
    const Verdict verdict =
        share > 0 ? turning_keep_distance_test(pair, {share, 0}, {}) : turning_test(pair, {});
    if (verdict.contact) least = std::min(least, verdict.toi);
  });
  return least;
}

// With a share of 0: before anything touches.
MaxStep max_step(const std::shared_ptr<const Scene>& scene, const Row& row, double share) {
  Collider collider = Collider::create(scene, std::span<const double>(row.x), {}, testing::workers()).value();
  QuestionOptions options;
  if (share > 0) options.keep_distance = share;
  return collider.max_step(row.frame(), false, options).value();
}

// A commit's room for roundings is beside it, some 2^-40 of a body's place.
TEST(KeepDistance, OnScrewsIsThatOfAllPairsOneByOne) {
  int cut_short = 0, whole = 0;
  for (std::uint64_t seed = 1; seed <= 600; ++seed) {
    Draws draws(seed);
    const Row row(draws);
    const double share = std::array{0.0, 0.1, 0.5, 0.9}[draws.below(4)];
    SCOPED_TRACE("seed " + std::to_string(seed) + ", share " + std::to_string(share));
    const auto scene = std::make_shared<const Scene>(Scene::create(row.scene).value());
    const MaxStep far = max_step(scene, row, share);
    const double least = one_by_one(*scene, row, share);
    ASSERT_NEAR(far.fraction, least, 1e-5);
    ASSERT_LE(far.fraction, least + 1e-9);
    (far.fraction == 1 ? whole : cut_short) += 1;
  }
  EXPECT_GT(cut_short, 200);
  EXPECT_GT(whole, 50);
}

// Of a scene so small that squares of its lengths are lost.
TEST(KeepDistance, OnScrewsIsThatOfAllPairsAtAnyScale) {
  int cut_short = 0;
  for (const int exponent : {-440, -452, -460, -480, -520, -540, -600, -900}) {
    for (std::uint64_t seed = 1; seed <= 60; ++seed) {
      Draws draws(seed);
      Row row(draws);
      for (double& x : row.x) x = std::ldexp(x, exponent);
      for (BodyPose& pose : row.poses) {
        for (std::size_t i = 0; i < 3; ++i)
          pose.pose.matrix[4 * i + 3] = std::ldexp(pose.pose.matrix[4 * i + 3], exponent);
      }
      const double share = std::array{0.0, 0.1, 0.5, 0.9}[draws.below(4)];
      SCOPED_TRACE("2^" + std::to_string(exponent) + ", seed " + std::to_string(seed));
      const auto scene = std::make_shared<const Scene>(Scene::create(row.scene).value());
      const MaxStep far = max_step(scene, row, share);
      ASSERT_LE(far.fraction, one_by_one(*scene, row, share) + 1e-9);
      cut_short += far.fraction < 1 ? 1 : 0;
    }
  }
  EXPECT_GT(cut_short, 100);
}

// What is known to be first, or not, is not changed by what starts too far away to be first.
TEST(KeepDistance, OnScrewsUpToATimeIsWhatIsFoundByThen) {
  int found = 0, later = 0;
  for (std::uint64_t seed = 1; seed <= 20000; ++seed) {
    testing::TurningCase drawn(seed);
    const KeepDistance keep{std::array{0.1, 0.5, 0.9}[drawn.below(3)], 0};
    const Verdict whole = turning_keep_distance_test(drawn.pair(), keep, {});
    for (const double latest : {0.5 * whole.toi, whole.toi, std::min(1.0, 1.01 * whole.toi), 0.3}) {
      const Verdict verdict = turning_keep_distance_test(drawn.pair(), keep, {.latest = latest});
      const bool by_then = whole.contact && whole.toi <= latest;
      ASSERT_EQ(verdict.contact, by_then) << seed << ' ' << latest;
      if (by_then) {
        ASSERT_EQ(verdict.toi, whole.toi) << seed << ' ' << latest;
      }
      (by_then ? found : later) += 1;
    }
  }
  EXPECT_GT(found, 2000);
  EXPECT_GT(later, 2000);
}

}  // namespace
}  // namespace warmfront

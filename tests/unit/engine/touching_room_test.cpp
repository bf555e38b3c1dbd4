// SPDX-License-Identifier: Apache-2.0
// What touches at the start may leave where no rounding takes it through: as what stands on the ground does.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <random>
#include <span>
#include <vector>

#include "engine/collider.h"
#include "engine/motion/commit_room.h"
#include "tests/support/poses.h"
#include "tests/support/workers.h"

namespace warmfront {
namespace {

/// A box that stands on the half-space below z = 0, whose bottom is at this height.
struct Standing {
  explicit Standing(BodyKind kind, bool screw = false, double bottom = 0) {
    for (const double z : {bottom, bottom + 0.75})
      start.insert(start.end(), {-0.25, -0.25, z, 0.5, -0.25, z, 0.5, 0.5, z, -0.25, 0.5, z});
    scene.vertex_count = 8;
    scene.faces = {{0, 2, 1}, {0, 3, 2}, {4, 5, 6}, {4, 6, 7}, {0, 1, 5}, {0, 5, 4},
                   {1, 2, 6}, {1, 6, 5}, {2, 3, 7}, {2, 7, 6}, {3, 0, 4}, {3, 4, 7}};
    scene.bodies = {{"", 0, 8, kind}, {"", 8, 0, BodyKind::kStatic}};
    scene.bodies[0].screw = screw;
    scene.bodies[1].half_space = HalfSpace{{0, 0, 0}, {0, 0, 2}};
  }
  Collider collider(Tier tier) const {
    return Collider::create(std::make_shared<const Scene>(Scene::create(scene).value()),
                            std::span<const double>(start), {.tier = tier}, testing::workers())
        .value();
  }

  SceneDescription scene;
  std::vector<double> start;
};

TEST(TouchingRoom, WhatStandsOnAHalfSpaceMayBeLiftedAndSlid) {
  const Standing standing(BodyKind::kDeformable);
  for (const Tier tier : {Tier::kCertified, Tier::kExact}) {
    for (const Rounding rounding : {Rounding::kFloat32, Rounding::kFloat64}) {
      for (const bool leave_out : {false, true}) {
        Collider collider = standing.collider(tier);
        const auto ask = [&](const std::array<double, 3>& by) {
          std::vector<double> there = standing.start;
          for (std::size_t i = 0; i < there.size(); ++i) there[i] = static_cast<float>(there[i] + by[i % 3]);
          return collider.max_step(std::span<const double>(there), leave_out, {}, nullptr, rounding).value();
        };
        for (const double by : {0.3, 1e-6}) {
          for (const auto& way : std::vector<std::array<double, 3>>{{0, 0, by}, {by, -by, by}, {by, by, 0}}) {
            EXPECT_EQ(ask(way).fraction, 1) << to_string(tier) << ' ' << leave_out << ' ' << way[2];
            EXPECT_EQ(ask(way).overlaps_at_start, 4U);
          }
          if (!leave_out) {
            EXPECT_EQ(ask({by, 0, -by}).fraction, 0);
          }
        }
      }
    }
  }
}

// By poses: where these translate, not where they turn.
TEST(TouchingRoom, WhatStandsOnAHalfSpaceMayBeLiftedByPoses) {
  for (const bool screw : {false, true}) {
    Collider collider = Standing(BodyKind::kRigid, screw).collider(Tier::kCertified);
    const auto ask = [&](const Pose& pose, Rounding rounding) {
      const std::vector<BodyPose> poses{{0, pose}};
      Frame frame;
      frame.poses = poses;
      return collider.max_step(frame, false, {}, nullptr, rounding).value().fraction;
    };
    for (const Rounding rounding : {Rounding::kFloat32, Rounding::kFloat64}) {
      Pose lifted, slid;
      lifted.matrix[11] = 0.25;
      slid.matrix[3] = 0.25;
      EXPECT_EQ(ask(lifted, rounding), 1);
      EXPECT_EQ(ask(slid, rounding), 1);
      Pose odd = lifted;
      odd.matrix[11] = 0.1;  // no float32
      EXPECT_EQ(ask(odd, rounding), rounding == Rounding::kFloat32 ? 0 : 1);
      EXPECT_EQ(ask(testing::turned_about_x(0.1), rounding), 0);
    }
  }
}

// Also where both ends are the same, a commit rounds what goes by poses.
TEST(TouchingRoom, WhatStandsOnAHalfSpaceThatTurnsInPlaceIsHeld) {
  Standing standing(BodyKind::kDeformable);
  standing.scene.bodies[1].kind = BodyKind::kRigid;
  Collider collider = standing.collider(Tier::kCertified);
  Pose turned;
  turned.matrix = {0.6, -0.8, 0, 0, 0.8, 0.6, 0, 0, 0, 0, 1, 0};
  const std::vector<BodyPose> poses{{1, turned}};
  std::vector<double> lifted = standing.start;
  for (std::size_t v = 0; v < 8; ++v) lifted[3 * v + 2] += 0.25;
  const std::vector<BodyPositions> bodies{{0, std::span<const double>(lifted)}};
  Frame frame;
  frame.bodies = bodies;
  EXPECT_EQ(collider.max_step(frame).value().fraction, 1);
  frame.poses = poses;
  EXPECT_EQ(collider.max_step(frame).value().fraction, 0);
}

// However deep: no rounding takes a vertex through what it is through.
TEST(TouchingRoom, WhatIsInAHalfSpaceMayLeaveItAndGoAlong) {
  SceneDescription scene;
  scene.vertex_count = 1;
  scene.bodies = {{"", 0, 1}, {"", 1, 0, BodyKind::kStatic}};
  for (const std::array<double, 3>& normal : {std::array<double, 3>{0, 0, 3}, {1, 1, 1}, {0.3, -0.1, 0.8}}) {
    scene.bodies.back().half_space = HalfSpace{{0, 0, 0}, normal};
    for (const double depth : {1e-9, 1e-3, 0.1, 10.0}) {
      std::vector<double> start(3);
      double squared = 0;
      for (const double x : normal) squared += x * x;
      for (std::size_t axis = 0; axis < 3; ++axis) start[axis] = -depth * normal[axis] / squared;
      for (const Tier tier : {Tier::kCertified, Tier::kExact}) {
        Collider collider =
            Collider::create(std::make_shared<const Scene>(Scene::create(scene).value()),
                             std::span<const double>(start), {.tier = tier}, testing::workers())
                .value();
        const auto ask = [&](double with_normal, double across) {
          std::vector<double> there = start;
          for (std::size_t axis = 0; axis < 3; ++axis) there[axis] += with_normal * normal[axis];
          there[0] += across * normal[1];
          there[1] -= across * normal[0];
          return collider.max_step(std::span<const double>(there)).value();
        };
        for (const double by : {1e-3, 0.1, 5.0}) {
          for (const double across : {0.0, 0.7, -2.0}) {
            EXPECT_EQ(ask(by, across).fraction, 1) << depth << ' ' << by << ' ' << across;
            EXPECT_EQ(ask(by, across).overlaps_at_start, 1U);
            EXPECT_EQ(ask(-by, across).fraction, 0);
          }
        }
      }
    }
  }
}

// A face at some height, all of whose corners go by as much, and a vertex a few bits above it: whatever part
// of what is granted is committed, it is above still.
TEST(TouchingRoom, WhatIsCommittedStaysAbove) {
  std::mt19937 random(7);
  const auto pick = [&](std::initializer_list<double> of) { return *(of.begin() + random() % of.size()); };
  std::size_t granted = 0, stopped = 0;
  for (int k = 0; k < 3000; ++k) {
    const Rounding rounding = random() % 2 == 0 ? Rounding::kFloat32 : Rounding::kFloat64;
    const auto held = [&](double x) { return rounding == Rounding::kFloat32 ? static_cast<float>(x) : x; };
    const std::size_t axis = random() % 3;
    const double height = held(pick({0, 0.1, -0.7, 1e-20, 100.3}));
    const double sense = pick({-1, 1});
    const auto at = [&](double u, double v, double h) {
      std::array<double, 3> x{};
      x[axis] = h;
      x[(axis + 1) % 3] = u;
      x[(axis + 2) % 3] = v;
      return x;
    };
    std::vector<double> start, end;
    double here = height;
    const auto put = [&](double u, double v, double by, double along) {
      for (const double x : at(held(u), held(v), here)) start.push_back(x);
      for (const double x : at(held(u + along), held(v), held(here + sense * by))) end.push_back(x);
    };
    const double of_face = pick({0, 0, 1e-9, -1e-9, -0.3, 0.3, -1e-300});
    for (const auto& [u, v] : {std::pair{0.0, 0.1}, {1.3, 0.0}, {0.2, 1.7}})
      put(u, v, of_face, pick({0, 0.1, -0.3}));
    const double next = rounding == Rounding::kFloat32
                            ? std::nextafter(static_cast<float>(height), static_cast<float>(sense * 1e9))
                            : std::nextafter(height, sense * 1e9);
    here = pick({next, held(height + 2 * (next - height)), held(height + sense * 1e-15),
                 held(height + sense * 1e-6)});
    if (sense * here <= sense * height) continue;
    put(0.4, 0.5, pick({0, 0, 1e-9, -1e-9, -0.3, 0.3, 1e-300}), pick({0, 0.2, -0.1}));
    const SceneDescription scene{4, {{0, 1, 2}}, {{"", 0, 3}, {"", 3, 1}}};
    Collider collider = Collider::create(std::make_shared<const Scene>(Scene::create(scene).value()),
                                         std::span<const double>(start), {}, testing::workers())
                            .value();
    const double most =
        collider.max_step(std::span<const double>(end), false, {}, nullptr, rounding).value().fraction;
    (most > 0 ? granted : stopped) += 1;
    const double part = most * pick({1, 0.5, 1e-9, 0.9, 0x1p-30, 1e-300});
    ASSERT_TRUE(collider.commit(part, rounding).ok());
    const std::vector<double> now = collider.positions();
    for (std::size_t v = 0; v < 3; ++v)
      ASSERT_GT(sense * now[9 + axis], sense * now[3 * v + axis]) << k << ' ' << part;
  }
  EXPECT_GT(granted, 500U);
  EXPECT_GT(stopped, 500U);
}

}  // namespace
}  // namespace warmfront

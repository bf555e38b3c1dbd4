// SPDX-License-Identifier: Apache-2.0
// max_step() of bodies that move along screws and start near what they may not come nearer to: they may
// leave, and what stops them keeps their thickness.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <optional>
#include <vector>

#include "engine/collider.h"
#include "tests/support/scenes.h"
#include "tests/support/workers.h"

namespace warmfront {
namespace {

constexpr double kThickness = 0.01;

// An octahedron, thick, whose lowest corner is so high above a large triangle, or a half-space, at z = 0.
struct Hovering {
  explicit Hovering(bool above_half_space, double height) {
    if (above_half_space) {
      Body ground{"", 0, 0, BodyKind::kStatic};
      ground.half_space = HalfSpace{{0, 0, 0}, {0, 0, 1}};
      scene.bodies.push_back(ground);
    } else {
      x = {-5, -5, 0, 5, -5, 0, 0, 5, 0};
      scene.faces.push_back({0, 1, 2});
      scene.bodies.push_back({"", 0, 3, BodyKind::kStatic});
      scene.vertex_count = 3;
    }
    const auto first = static_cast<std::int32_t>(scene.vertex_count);
    for (const auto& [a, b, c] : testing::octahedron())
      scene.faces.push_back({a + first, b + first, c + first});
    Body body{"", scene.vertex_count, 6, BodyKind::kRigid};
    body.thickness = kThickness;
    body.screw = true;
    scene.bodies.push_back(body);
    scene.vertex_count += 6;
    middle = height + 0.3;
    for (const double side : {0.3, -0.3}) {
      for (const int axis : {0, 1, 2})
        for (const int k : {0, 1, 2}) x.push_back((k == axis ? side : 0) + (k == 2 ? middle : 0));
    }
  }
  Collider collider() const {
    return Collider::create(std::make_shared<const Scene>(Scene::create(scene).value()),
                            std::span<const double>(x), {}, testing::workers())
        .value();
  }
  // Turned about its middle, around x, and higher.
  BodyPose pose(double degrees, double rise) const {
    const double angle = degrees * std::numbers::pi / 180, c = std::cos(angle), s = std::sin(angle);
    return {1, {{1, 0, 0, 0, 0, c, -s, s * middle, 0, s, c, middle - c * middle + rise}}};
  }
  static Frame frame(const BodyPose& pose) {
    Frame frame;
    frame.poses = {&pose, 1};
    return frame;
  }

  SceneDescription scene;
  std::vector<double> x;
  double middle = 0;
};

double lowest(const Collider& collider) {
  const std::vector<double> x = collider.positions();
  double least = 10;
  for (std::size_t i = x.size() - 18; i < x.size(); i += 3) least = std::min(least, x[i + 2]);
  return least;
}

class ScrewRoom : public ::testing::TestWithParam<bool> {};

TEST_P(ScrewRoom, WhatStartsWithinItsThicknessMayLeave) {
  for (const double height : {0.008, 0.001, kThickness}) {
    const Hovering hovering(GetParam(), height);
    for (const double degrees : {0.0, 1e-3, 1.0, 20.0}) {
      Collider collider = hovering.collider();
      for (const std::optional<double> keep : {std::optional<double>(), std::optional(0.1)}) {
        const BodyPose away = hovering.pose(degrees, 0.3), nearer = hovering.pose(degrees, -0.001);
        const QuestionOptions options{.keep_distance = keep};
        EXPECT_EQ(collider.max_step(Hovering::frame(away), false, options).value().fraction, 1)
            << height << ' ' << degrees;
        EXPECT_EQ(collider.max_step(Hovering::frame(nearer), false, options).value().fraction, 0)
            << height << ' ' << degrees;
      }
    }
  }
}

// It stops as far from its thickness as the tolerance has it, and is then not taken for near.
TEST_P(ScrewRoom, WhatWasStoppedKeepsItsThickness) {
  const Hovering hovering(GetParam(), 0.4);
  for (const double degrees : {5.0, 20.0, 60.0}) {
    for (const double fall : {-0.6, -1.0}) {
      Collider collider = hovering.collider();
      const BodyPose down = hovering.pose(degrees, fall);
      for (int step = 0; step < 4; ++step) {
        const MaxStep most = collider.max_step(Hovering::frame(down), step > 0).value();
        ASSERT_TRUE(collider.commit(most.fraction).ok());
        EXPECT_GE(lowest(collider), kThickness) << degrees << ' ' << fall << ' ' << step;
      }
      EXPECT_LT(lowest(collider), kThickness + 1e-5);
      const BodyPose up = hovering.pose(degrees, 1);
      EXPECT_EQ(collider.max_step(Hovering::frame(up)).value().fraction, 1) << degrees << ' ' << fall;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(OfATriangleAndAHalfSpace, ScrewRoom, ::testing::Bool());

}  // namespace
}  // namespace warmfront

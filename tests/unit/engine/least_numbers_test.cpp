// SPDX-License-Identifier: Apache-2.0
// Distances of a few of the least numbers that there are, which are all equally far apart.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <memory>
#include <vector>

#include "engine/collider.h"
#include "tests/support/workers.h"

namespace warmfront {
namespace {

// 3 k u / sqrt(3) above a half-space, u being the least number: what is told is no more.
TEST(LeastNumbers, DistancesToAHalfSpaceAreBounds) {
  constexpr double kLeast = std::numeric_limits<double>::denorm_min();
  SceneDescription description{1, {}, {{"", 0, 1}, {"", 1, 0, BodyKind::kStatic}}};
  description.bodies[1].half_space = HalfSpace{{0, 0, 0}, {1, 1, 1}};
  const auto scene = std::make_shared<const Scene>(Scene::create(description).value());
  for (int k = 1; k < 60; ++k) {
    const std::vector<double> at(3, k * kLeast);
    Collider collider = Collider::create(scene, std::span<const double>(at), {}, testing::workers()).value();
    const double told = collider.vertex_distances(1).value().vertex_distances[0] / kLeast;
    EXPECT_LE(told, std::sqrt(3.0) * k) << k;
    EXPECT_GE(told, std::sqrt(3.0) * k - 3) << k;
  }
}

}  // namespace
}  // namespace warmfront

// SPDX-License-Identifier: Apache-2.0
// What filters leave out and when they are refused, by examples.
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <utility>

#include "engine/collider.h"
#include "tests/support/scenes.h"
#include "tests/support/workers.h"

namespace warmfront {
namespace {

// A sheet of n x n quads, its vertex (i, j) at (i, j, 0).
struct Sheet {
  explicit Sheet(int n) : description{static_cast<std::uint32_t>((n + 1) * (n + 1)), testing::grid(n), {}} {
    for (int i = 0; i <= n; ++i)
      for (int j = 0; j <= n; ++j) x.insert(x.end(), {1.0 * i, 1.0 * j, 0});
  }
  StepResult near(PairFilters filters, double distance) {
    description.filters = std::move(filters);
    scene = std::make_shared<const Scene>(Scene::create(description).value());
    Collider collider =
        Collider::create(scene, std::span<const double>(x), {.tier = Tier::kExact}, testing::workers())
            .value();
    const StepResult answer = collider.proximity(distance).value();
    contacts.assign(answer.contacts.begin(), answer.contacts.end());
    return answer;
  }

  SceneDescription description;
  std::vector<double> x;
  std::shared_ptr<const Scene> scene;
  std::vector<Contact> contacts;
};

TEST(Filters, ThreeRingsMakeTwoEdgeLengthsUsable) {
  Sheet sheet(12);
  const std::uint64_t without = sheet.near({}, 2).vf;
  const std::uint64_t two_rings = sheet.near({.within_edges = 2}, 2).vf;
  const StepResult three_rings = sheet.near({.within_edges = 3}, 2);
  EXPECT_GT(without, 4000U);
  EXPECT_LT(two_rings, without / 10);
  EXPECT_EQ(three_rings.vf, 0U);
  EXPECT_EQ(three_rings.ee, 0U);
  EXPECT_GT(three_rings.statistics.counts.triangle_pairs_filtered, 1000U);
}

TEST(Filters, WhatIsNearAtRestIsWhatProximityFindsThere) {
  Sheet sheet(6);
  ASSERT_GT(sheet.near({}, 1.5).ee, 0U);
  EXPECT_EQ(sheet.near({.near_at_rest = 1.5, .rest_positions = sheet.x}, 1.5).ee, 0U);
  EXPECT_TRUE(sheet.contacts.empty());
  // An ulp less leaves those in that are so far apart.
  const double less = std::nextafter(1.0, 0.0);
  ASSERT_EQ(sheet.near({.near_at_rest = 1, .rest_positions = sheet.x}, 1).vf, 0U);
  EXPECT_GT(sheet.near({.near_at_rest = less, .rest_positions = sheet.x}, 1).vf, 0U);
}

// What was found while nothing moved is of the filters that there were.
TEST(Filters, ChangeWhatIsKeptOfWhatRests) {
  std::vector<double> x{0, 0, 0, 4, 0, 0, 0, 4, 0, 1, 1, 0, 1, 1, 1, 2, 1, 1, 9, 9, 9};
  SceneDescription two{7, {{0, 1, 2}, {3, 4, 5}}, {{"", 0, 3}, {"", 3, 3}, {"", 6, 1}}};
  const auto scene = std::make_shared<const Scene>(Scene::create(two).value());
  Collider collider = Collider::create(scene, std::span<const double>(x), {}, testing::workers()).value();
  const auto found = [&] {
    x[18] += 1;  // elsewhere
    const StepResult step = collider.step(std::span<const double>(x)).value();
    return std::pair(step.vf + step.ee, step.statistics.counts.contacts_kept);
  };
  found();
  const auto [before, kept] = found();
  ASSERT_GT(before, 0U);
  ASSERT_EQ(kept, before);
  ASSERT_TRUE(collider.change_filters({.patches = std::vector<std::uint32_t>(7, 1)}).ok());
  EXPECT_EQ(found().first, 0U);
  EXPECT_EQ(found().first, 0U);
  ASSERT_TRUE(collider.change_filters({}).ok());
  EXPECT_EQ(found().first, before);
}

TEST(Filters, AreRefusedByFieldAndPlace) {
  Sheet sheet(1);
  const auto message = [&](PairFilters filters) -> std::string {
    SceneDescription description = sheet.description;
    description.filters = std::move(filters);
    const Result<Scene> scene = Scene::create(std::move(description));
    if (scene) return "taken";
    EXPECT_EQ(scene.error().code, ErrorCode::kInvalidArgument);
    return scene.error().message;
  };
  EXPECT_NE(message({.within_edges = 4}).find("filters.within_edges: is 4"), std::string::npos);
  EXPECT_NE(message({.near_at_rest = -1}).find("filters.near_at_rest"), std::string::npos);
  EXPECT_NE(message({.near_at_rest = 1}).find("filters.rest_positions: 0 values where 12"),
            std::string::npos);
  EXPECT_NE(message({.rest_positions = sheet.x}).find("has no effect"), std::string::npos);
  EXPECT_NE(message({.near_at_rest = 1, .rest_positions = {0, 0, 0, 0, 1e308 * 10, 0, 0, 0, 0, 0, 0, 0}})
                .find("filters.rest_positions[1].y"),
            std::string::npos);
  EXPECT_NE(message({.excluded_vertex_pairs = {{0, 1}, {2, 4}}})
                .find("filters.excluded_vertex_pairs[1]: vertex 4 is not in [0, 4)"),
            std::string::npos);
  EXPECT_NE(message({.excluded_vertex_pairs = {{3, 3}}}).find("with itself"), std::string::npos);
  EXPECT_NE(message({.patches = {1, 1, 1}}).find("filters.patches: 3 values where 4"), std::string::npos);
}

TEST(Filters, RefuseRingsOfHubsAndLeaveTheColliderAsItWas) {
  // A wheel's rim is within two edges of itself: its hub alone makes 900 x 900 ways, below what every
  // scene may have, and 900 x 3 x 900 x 2 of three edges. Four of these are above it.
  constexpr std::int32_t kRim = 900;
  SceneDescription wheels;
  std::vector<double> x;
  for (std::int32_t wheel = 0; wheel < 4; ++wheel) {
    const auto hub = static_cast<std::int32_t>(wheels.vertex_count);
    wheels.vertex_count += kRim + 1;
    wheels.bodies.push_back({"", static_cast<std::uint32_t>(hub), kRim + 1});
    for (std::int32_t i = 0; i < kRim; ++i)
      wheels.faces.push_back({hub, hub + 1 + i, hub + 1 + (i + 1) % kRim});
    x.insert(x.end(), {0, 0, 5.0 * wheel});
    for (std::int32_t i = 0; i < kRim; ++i)
      x.insert(x.end(), {std::cos(0.005 * i), std::sin(0.005 * i), 5.0 * wheel});
  }
  const auto scene = std::make_shared<const Scene>(Scene::create(wheels).value());
  Collider collider = Collider::create(scene, std::span<const double>(x), {}, testing::workers()).value();
  ASSERT_TRUE(collider.change_filters({.within_edges = 2}).ok());
  const Status refused = collider.change_filters({.within_edges = 3});
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, ErrorCode::kResourceExhausted);
  EXPECT_NE(refused.error().message.find("vertex 0 alone is in 900 edges"), std::string::npos)
      << refused.error().message;
  EXPECT_EQ(collider.scene().filters().within_edges, 2U);
  EXPECT_FALSE(collider.change_filters({.patches = {1}}).ok());
  EXPECT_EQ(collider.scene().filters().within_edges, 2U);
}

}  // namespace
}  // namespace warmfront

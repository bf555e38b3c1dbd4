// SPDX-License-Identifier: Apache-2.0
// Options and excluded pairs that change: what is refused and how, together with changes of the scene or
// alone; and what stays warm.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <span>

#include "engine/collider.h"
#include "tests/support/scenes.h"

namespace warmfront {
namespace {

using testing::grid;
using ::testing::HasSubstr;

// Three sheets of 2 x 2 quads, 0.1 apart; frame k lets them fall towards height 0.
class ChangeOptionsTest : public ::testing::Test {
 protected:
  static constexpr std::uint32_t kEach = 9;

  ChangeOptionsTest() {
    for (std::uint32_t body = 0; body < 3; ++body) {
      for (auto face : grid(2)) {
        for (std::int32_t& v : face) v += static_cast<std::int32_t>(kEach * body);
        scene_.faces.push_back(face);
      }
      scene_.bodies.push_back({"", kEach * body, kEach});
      for (int i = 0; i < 9; ++i) start_.insert(start_.end(), {0.5 * (i / 3), 0.5 * (i % 3), 0.1 * body});
    }
    scene_.vertex_count = 3 * kEach;
  }

  Collider make(const ColliderOptions& options = {}) const {
    return Collider::create(std::make_shared<const Scene>(Scene::create(scene_).value()),
                            std::span<const double>(start_), options, std::make_shared<Workers>(1))
        .value();
  }
  StepResult step(Collider& collider, double factor) const {
    std::vector<double> positions = start_;
    for (std::size_t z = 2; z < positions.size(); z += 3) positions[z] *= factor;
    return collider.step(std::span<const double>(positions)).value();
  }
  static void expect_refused(const Status& status, const char* message) {
    ASSERT_FALSE(status.ok());
    EXPECT_EQ(status.error().code, ErrorCode::kInvalidArgument);
    EXPECT_THAT(status.error().message, HasSubstr(message));
  }

  SceneDescription scene_;
  std::vector<double> start_;
};

TEST_F(ChangeOptionsTest, WhatWasGivenOnceHoldsFromThenOn) {
  Collider collider = make();
  EXPECT_EQ(step(collider, 0.9).contacts.size(), 0U);
  ColliderOptions near{.min_separation = 0.085};
  near.fields.points = true;
  ASSERT_TRUE(collider.change_options(near).ok());
  const StepResult found = step(collider, 0.8);
  EXPECT_GT(found.contacts.size(), 0U);
  EXPECT_EQ(found.geometry.size(), found.contacts.size());
  Collider fresh = make(near);
  step(fresh, 0.9);
  EXPECT_EQ(step(fresh, 0.8).contacts.size(), found.contacts.size());
  near.report = Report::kCount;
  ASSERT_TRUE(collider.change_options(near).ok());
  EXPECT_TRUE(step(collider, 0.7).contacts.empty());
}

TEST_F(ChangeOptionsTest, SayWhichOfThemAreFixed) {
  Collider collider = make();
  const ColliderOptions before = collider.options();
  const auto refuse = [&](auto change, const char* message) {
    ColliderOptions other;
    change(other);
    expect_refused(collider.change_options(other), message);
    EXPECT_TRUE(collider.options() == before);
  };
  refuse([](ColliderOptions& o) { o.bounds = BoundsKind::kAabb; }, "bounds: is fixed");
  refuse([](ColliderOptions& o) { o.find_bodies = false; }, "find_bodies: is fixed");
  refuse([](ColliderOptions& o) { o.leaf_size = 8; }, "leaf_size: is fixed");
  refuse([](ColliderOptions& o) { o.normal_cones = true; }, "normal_cones: is fixed");
  refuse([](ColliderOptions& o) { o.explain = true; }, "explain: is fixed");
  refuse([](ColliderOptions& o) { o.tolerance = 2; }, "tolerance");
  refuse([](ColliderOptions& o) { o.keep_distance = 0.5; }, "keep_distance: it is of max_step alone");
}

TEST_F(ChangeOptionsTest, OfAThickSceneAreNotFast) {
  scene_.bodies[1].thickness = 0.01;
  Collider collider = make();
  expect_refused(collider.change_options({.tier = Tier::kFast}), "thickness: tier \"fast\"");
  std::size_t failed = 0;
  Body thin = scene_.bodies[1];
  thin.thickness = 0;
  EXPECT_TRUE(
      collider.change({ChangeBody{1, thin}}, nullptr, &failed, ColliderOptions{.tier = Tier::kFast}).ok())
      << "together they fit";
  expect_refused(collider.change({ChangeBody{1, scene_.bodies[1]}}, nullptr, &failed),
                 "thickness: tier \"fast\"");
  EXPECT_EQ(collider.scene().most_thickness(), 0);
}

TEST_F(ChangeOptionsTest, AreTakenWithAllChangesOrWithNone) {
  Collider collider = make();
  step(collider, 0.9);
  std::size_t failed = 9;
  const ColliderOptions exact{.tier = Tier::kExact};
  expect_refused(collider.change({ChangeExcludedPairs{{{0, 1}}}, ChangeExcludedPairs{{{1, 3}}}}, nullptr,
                                 &failed, exact),
                 "excluded_pairs[0]: body 3 is not in [0, 3)");
  EXPECT_EQ(failed, 1U);
  EXPECT_TRUE(collider.options() == ColliderOptions());
  EXPECT_TRUE(collider.scene().excluded_pairs().empty());
  expect_refused(
      collider.change({ChangeExcludedPairs{{{0, 1}}}}, nullptr, &failed, ColliderOptions{.leaf_size = 4}),
      "leaf_size");
  EXPECT_EQ(failed, 1U) << "none of the changes";
  EXPECT_TRUE(collider.scene().excluded_pairs().empty());
  ASSERT_TRUE(collider.change({ChangeExcludedPairs{{{0, 1}}}}, nullptr, &failed, exact).ok());
  EXPECT_EQ(collider.options().tier, Tier::kExact);
  EXPECT_EQ(collider.scene().excluded_pairs().size(), 1U);
}

TEST_F(ChangeOptionsTest, ExcludedPairsComeAndGo) {
  Collider collider = make();
  const std::size_t all = step(collider, 0).contacts.size();
  ASSERT_TRUE(collider.change_excluded_pairs({{0, 1}, {1, 2}}).ok());
  const std::size_t fewer = step(collider, 1).contacts.size();
  EXPECT_LT(fewer, all);
  EXPECT_GT(fewer, 0U) << "0 and 2";
  ASSERT_TRUE(collider.change_excluded_pairs({{0, 1}, {1, 2}, {2, 0}}).ok());
  EXPECT_EQ(step(collider, 0).contacts.size(), 0U);
  ASSERT_TRUE(collider.change_excluded_pairs({}).ok());
  EXPECT_EQ(step(collider, 1).contacts.size(), all);
  expect_refused(collider.change_excluded_pairs({{1, 1}}), "body 1 with itself");
  EXPECT_EQ(step(collider, 0).contacts.size(), all) << "it is as it was";
}

TEST_F(ChangeOptionsTest, WarmthStaysUnlessItsOwnOptionsChange) {
  Collider collider = make();
  step(collider, 0.99);
  step(collider, 0.98);
  ASSERT_TRUE(collider.change_options({.tolerance = 1e-4, .max_contacts = 1000}).ok());
  EXPECT_EQ(step(collider, 0.97).statistics.front_state, FrontState::kUpdated);
  ASSERT_TRUE(collider.change_options({.front = FrontMode::kPaper}).ok());
  EXPECT_EQ(step(collider, 0.96).statistics.front_state, FrontState::kRebuilt);
}

}  // namespace
}  // namespace warmfront

// SPDX-License-Identifier: Apache-2.0
// max_step() with keep_distance on scenes whose answer is known, and what it refuses.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <memory>
#include <vector>

#include "engine/collider.h"
#include "tests/support/scenes.h"
#include "tests/support/workers.h"

namespace warmfront {
namespace {

using ::testing::HasSubstr;
using Doubles = std::span<const double>;

/// A triangle above another one at a height, of the scene's size and place.
std::vector<double> triangles(double height, double scale = 1, double offset = 0) {
  std::vector<double> positions{0,   0,   0,      3,   0,   0,          0,   3,   0,
                                0.5, 0.5, height, 1.5, 0.5, height + 1, 0.5, 1.5, height + 1};
  for (double& x : positions) x = scale * x + offset;
  return positions;
}

Collider collider_at(const std::vector<double>& x, const ColliderOptions& options = {}) {
  static const auto scene = testing::make_scene(6, {{0, 1, 2}, {3, 4, 5}});
  return Collider::create(scene, Doubles(x), options, testing::workers()).value();
}

double fraction(double from, double to, const QuestionOptions& options, double scale = 1, double offset = 0) {
  const std::vector<double> x = triangles(from, scale, offset);
  const std::vector<double> y = triangles(to, scale, offset);
  Collider collider = collider_at(x);
  const MaxStep far = collider.max_step(Doubles(y), false, options).value();
  EXPECT_EQ(far.first.has_value(), far.fraction < 1);
  return far.fraction;
}

// Found to within 2^-8 of what the pair may approach, and never late.
void expect_found(double found, double truth) {
  EXPECT_LE(found, truth * (1 + 1e-12));
  EXPECT_GE(found, truth * (1 - 0x1p-7));
}

TEST(KeepDistanceOf, TwoTriangles) {
  expect_found(fraction(1, -1, {.keep_distance = 0.5}), 0.25);
  expect_found(fraction(1, -1, {.keep_distance = 0.9}), 0.05);
  expect_found(fraction(1, -1, {.keep_distance = 0.001}), 0.4995);
  expect_found(fraction(1, -1, {.min_separation = 0.2, .keep_distance = 0.5}), 0.2);
  expect_found(fraction(1, -1, {.tier = Tier::kExact, .keep_distance = 0.5}), 0.25);
  EXPECT_EQ(fraction(1, 0.51, {.keep_distance = 0.5}), 1) << "that is kept";
  EXPECT_EQ(fraction(1, 2, {.keep_distance = 0.999}), 1) << "it moves away";
  EXPECT_EQ(fraction(1, 1, {.keep_distance = 0.999}), 1) << "nothing moves";
  EXPECT_EQ(fraction(1, 1, {.min_separation = 0.5, .keep_distance = 0.999}), 1) << "nothing moves";
}

TEST(KeepDistanceOf, TrianglesAtAnyScaleAndPlace) {
  for (const double scale : {0x1p-900, 0x1p-60, 0x1p60, 0x1p900})
    EXPECT_EQ(fraction(1, -1, {.keep_distance = 0.5}, scale), fraction(1, -1, {.keep_distance = 0.5}));
  expect_found(fraction(1, -1, {.keep_distance = 0.5}, 1, 0x1p20), 0.25);
}

// A pair that is near beside its features' size is granted its share, too.
TEST(KeepDistanceOf, WhatIsVeryNear) {
  for (const double height : {1e-3, 1e-5, 1e-7, 1e-9}) {
    SCOPED_TRACE(height);
    expect_found(fraction(height, -height, {.keep_distance = 0.5}), 0.25);
    expect_found(fraction(height, 0, {.keep_distance = 0.9}), 0.1);
  }
}

// Two that come towards each other as fast as anything moves, and only just too near at the very end: the
// widest separation there is. Ways are such that it is the least that any cull may go by.
TEST(KeepDistanceOf, WhatIsFarthestApart) {
  for (const double s : {0.5, 0.75, 0.9, 0.1}) {
    for (const FrontMode front : {FrontMode::kWarm, FrontMode::kNone}) {
      for (const BoundsKind bounds : {BoundsKind::kKDop18, BoundsKind::kAabb}) {
        for (const bool bodies : {true, false}) {
          const double way =
              (1 - 1e-9) * (1 - s) / s;  // of each; together s / (1 - s) of that is just below 2
          const double apart = 2 * way / (1 - s) * (1 - 1e-6);
          std::vector<double> x = triangles(apart);
          std::vector<double> y = triangles(apart - way);
          for (const std::size_t z : {2, 5, 8}) y[z] += way;
          Collider collider = collider_at(x, {.front = front, .bounds = bounds, .find_bodies = bodies});
          const MaxStep far = collider.max_step(Doubles(y), false, {.keep_distance = s}).value();
          expect_found(far.fraction, 1 - 1e-6);
          EXPECT_TRUE(far.first.has_value());
        }
      }
    }
  }
}

TEST(KeepDistanceOf, OverlapsAtTheStartAreToldApart) {
  const std::vector<double> x = triangles(0.1);
  const std::vector<double> y = triangles(0.05);
  Collider collider = collider_at(x);
  const QuestionOptions within{.min_separation = 0.2, .keep_distance = 0.5};
  const MaxStep all = collider.max_step(Doubles(y), false, within).value();
  EXPECT_EQ(all.fraction, 0);
  EXPECT_GT(all.overlaps_at_start, 0U);
  const MaxStep others = collider.max_step(Doubles(triangles(0.06)), true, within).value();
  EXPECT_EQ(others.fraction, 1);
  EXPECT_EQ(others.overlaps_at_start, all.overlaps_at_start);
  // They keep their share of their own distance.
  const MaxStep through = collider.max_step(Doubles(triangles(-0.1)), true, within).value();
  EXPECT_NEAR(through.fraction, 0.25, 0.01);
}

// It may be committed like any trial, and does not affect the answers to later questions.
TEST(KeepDistanceOf, AMotionThatIsThenCommitted) {
  const std::vector<double> x = triangles(1);
  const std::vector<double> y = triangles(-1);
  Collider collider = collider_at(x);
  const double before = collider.max_step(Doubles(y)).value().fraction;
  const double kept = collider.max_step(Doubles(y), false, {.keep_distance = 0.5}).value().fraction;
  EXPECT_EQ(collider.max_step(Doubles(y)).value().fraction, before);
  EXPECT_EQ(collider.max_step(Doubles(y), false, {.keep_distance = 0.5}).value().fraction, kept);
  ASSERT_TRUE(collider.commit(kept).ok());
  expect_found(collider.max_step(Doubles(x), false, {.keep_distance = 0.5}).value().fraction, 1);
  EXPECT_TRUE(collider.self_check().ok());
}

TEST(KeepDistanceOf, AnotherQuestionOrOutOfRangeIsRefused) {
  const std::vector<double> x = triangles(1);
  const std::vector<double> y = triangles(-1);
  Collider collider = collider_at(x);
  const auto refused = [&](const auto& result, const char* words) {
    ASSERT_FALSE(result.ok());
    EXPECT_EQ(result.error().code, ErrorCode::kInvalidArgument);
    EXPECT_THAT(result.error().message, HasSubstr(words));
    EXPECT_EQ(collider.positions(), x);
    EXPECT_FALSE(collider.commit().ok()) << "no trial was answered";
  };
  for (const double s : {0.0, 1.0, -0.5, 2.0, std::numeric_limits<double>::quiet_NaN(),
                         std::numeric_limits<double>::infinity()})
    refused(collider.max_step(Doubles(y), false, {.keep_distance = s}), " is not in (0, 1)");
  refused(collider.max_step(Doubles(y), false, {.tier = Tier::kFast, .keep_distance = 0.5}),
          "keep_distance: tier \"fast\"");
  refused(collider.trial(Doubles(y), {.keep_distance = 0.5}), "keep_distance: it is of max_step alone");
  refused(collider.step(Doubles(y), nullptr, {}, {.keep_distance = 0.5}),
          "keep_distance: it is of max_step alone");
  for (const QuestionKind kind : {QuestionKind::kStep, QuestionKind::kTrial})
    refused(collider.ask(Doubles(y), {kind, {.keep_distance = 0.5}}),
            "keep_distance: it is of max_step alone");
  const auto made = Collider::create(testing::make_scene(6, {{0, 1, 2}, {3, 4, 5}}), Doubles(x),
                                     {.keep_distance = 0.5}, testing::workers());
  ASSERT_FALSE(made.ok());
  EXPECT_THAT(made.error().message, HasSubstr("keep_distance: it is of max_step alone"));
}

// Ways and separations that are beyond a share of double's range, or all of it.
TEST(KeepDistance, AtTheLargestNumbers) {
  const auto fraction = [](const SceneDescription& scene, std::vector<double> x, double to, double share,
                           double separation = 0) {
    Collider collider = Collider::create(std::make_shared<const Scene>(Scene::create(scene).value()),
                                         Doubles(x), {.min_separation = separation}, testing::workers())
                            .value();
    x[2] = to;
    return collider.max_step(Doubles(x), false, {.keep_distance = share}).value().fraction;
  };
  SceneDescription ground{1, {}, {{"", 0, 1}, {"", 1, 0, BodyKind::kStatic}}};
  ground.bodies[1].half_space = HalfSpace{{0, 0, 0}, {0, 0, 1}};
  EXPECT_EQ(fraction(ground, {0, 0, 0.9e308}, 0.5e308, 0.01, 1e308), 0);
  EXPECT_LE(fraction(ground, {0, 0, 0.9e308}, 0.5e308, 0.99), 0.0225 * (1 + 1e-9));
  EXPECT_GE(fraction(ground, {0, 0, 0.9e308}, 0.5e308, 0.99), 0.02);
  const SceneDescription face{4, {{1, 2, 3}}, {{"", 0, 1}, {"", 1, 3, BodyKind::kStatic}}};
  for (const double share : {0.1, 0.5, 0.9}) {
    const double most =
        fraction(face, {0, 0, 1.5e308, -1e308, -1e308, 0, 1e308, -1e308, 0, 0, 1e308, 0}, -1.5e308, share);
    EXPECT_LE(most, (1 - share) / 2 * (1 + 1e-9)) << share;
    EXPECT_GE(most, (1 - share) / 2 * 0.9) << share;
  }
}

}  // namespace
}  // namespace warmfront

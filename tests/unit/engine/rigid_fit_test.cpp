// SPDX-License-Identifier: Apache-2.0
// What a rigid fit of a body tells, and what is proved of its distances between two of them.
#include "engine/motion/rigid_fit.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include "engine/motion/least_stretch.h"
#include "engine/state/rigid_parts.h"
#include "tests/unit/engine/wavy_sheets.h"

namespace warmfront {
namespace {

using testing::WavySheets;

TEST(RigidFit, IsAsGoodAsTheWorstVertex) {
  const WavySheets sheets(1, 8);
  std::vector<VertexMotion> vertices(81);
  for (std::size_t v = 0; v < 81; ++v) {
    const double* x = sheets.x.data() + 3 * v;
    vertices[v].t0 = {x[0], x[1], x[2], 0};
    vertices[v].t1 = {-x[1] + 5, x[0] - 7, x[2] + 0.125, 0};  // a quarter turn
  }
  const RigidReference reference(vertices);
  EXPECT_FALSE(reference.flat());
  const RigidReference::Fit there = reference.fit(vertices, true, 1e-3);
  const RigidReference::Fit turned = reference.fit(vertices, false, 1e-3);
  EXPECT_LT(there.residual, 1e-12);
  EXPECT_LT(turned.residual, 1e-12);
  EXPECT_NEAR(cosine_between(there.linear, turned.linear), 0, 1e-12);
  vertices[40].t1[2] += 2e-4;
  EXPECT_NEAR(reference.fit(vertices, false, 1e-3).residual, 2e-4, 1e-9);
  EXPECT_EQ(reference.fit(vertices, false, 1e-4).residual, std::numeric_limits<double>::infinity());
}

TEST(RigidFit, CollinearPointsHaveNoFit) {
  std::vector<VertexMotion> line(9);
  for (std::size_t v = 0; v < line.size(); ++v) line[v].t0 = line[v].t1 = {static_cast<double>(v), 0, 0, 0};
  EXPECT_TRUE(RigidReference(line).flat());
  EXPECT_EQ(RigidReference(line).fit(line, true, 1).residual, std::numeric_limits<double>::infinity());
  std::vector<VertexMotion> tiny(4);
  tiny[1].t0[0] = tiny[2].t0[1] = tiny[3].t0[2] = 1e-170;  // whose squares vanish
  EXPECT_TRUE(RigidReference(tiny).flat());
}

TEST(RigidFit, FindsWhatIsBetweenTwoPlacesOfABody) {
  for (const double height : {0.05, 0.0}) {  // also of what lies in a plane
    std::vector<VertexMotion> vertices(81);
    for (std::size_t v = 0; v < 81; ++v) {
      const double x = static_cast<double>(v / 9) / 8;
      const double y = static_cast<double>(v % 9) / 8;
      const double z = height * std::sin(7 * x * y);
      vertices[v].t0 = {x, y, z, 0};
      // A quarter of the way of a sixth of a turn, with a drift.
      const double turned[2] = {0.5 * x - std::sqrt(0.75) * y, std::sqrt(0.75) * x + 0.5 * y};
      vertices[v].t1 = {0.75 * x + 0.25 * (turned[0] + 3), 0.75 * y + 0.25 * (turned[1] - 2), z + 0.25, 0};
    }
    const RigidReference reference(vertices);
    constexpr double kNone = std::numeric_limits<double>::infinity();
    EXPECT_EQ(reference.fit(vertices, false, 1e-3).residual, kNone);
    const RigidReference::Fit between = reference.fit_between(vertices, false, 1e-3);
    EXPECT_FALSE(between.turned);
    EXPECT_LT(between.residual, 1e-12);
    const LinearMap expected{0.875, -0.25 * std::sqrt(0.75), 0, 0.25 * std::sqrt(0.75), 0.875, 0, 0, 0, 1};
    for (std::size_t k = 0; k < 9; ++k) EXPECT_NEAR(between.linear[k], expected[k], 1e-10) << k;
    vertices[40].t1[2] += 2e-4;
    EXPECT_NEAR(reference.fit_between(vertices, false, 1e-3).residual, 2e-4, 1e-7);
    EXPECT_EQ(reference.fit_between(vertices, false, 1e-4).residual, kNone);
  }
}

LinearMap turn_about_z(double degrees) {
  const double angle = degrees * std::acos(-1.0) / 180;
  return {std::cos(angle), -std::sin(angle), 0, std::sin(angle), std::cos(angle), 0, 0, 0, 1};
}

LinearMap between(const LinearMap& a, const LinearMap& b, double t) {
  LinearMap m;
  for (std::size_t k = 0; k < 9; ++k) m[k] = a[k] + t * (b[k] - a[k]);
  return m;
}

TEST(RemainsSpread, WhatTurnsByLessThanAQuarter) {
  EXPECT_TRUE(remains_spread(turn_about_z(0), turn_about_z(0)));
  EXPECT_TRUE(remains_spread(turn_about_z(20), turn_about_z(109)));
  EXPECT_FALSE(remains_spread(turn_about_z(20), turn_about_z(112)));
  EXPECT_FALSE(remains_spread(turn_about_z(0), turn_about_z(180)));
  const LinearMap half = between(turn_about_z(0), turn_about_z(60), 0.5);
  EXPECT_TRUE(remains_spread(turn_about_z(0), half));
  EXPECT_TRUE(remains_spread(half, turn_about_z(60)));
  EXPECT_TRUE(remains_spread(half, turn_about_z(75)));
  EXPECT_FALSE(remains_spread(half, turn_about_z(150)));
}

TEST(RemainsSpread, NothingThatShrinksStretchesOrMirrors) {
  const LinearMap stays = turn_about_z(0);
  const auto scaled = [](double x, double z) { return LinearMap{x, 0, 0, 0, 1, 0, 0, 0, z}; };
  EXPECT_TRUE(remains_spread(stays, scaled(0.72, 1)));
  EXPECT_FALSE(remains_spread(stays, scaled(0.7, 1)));
  EXPECT_FALSE(remains_spread(scaled(1, 0.7), stays));
  EXPECT_TRUE(remains_spread(stays, scaled(1, 1.49)));
  EXPECT_FALSE(remains_spread(stays, scaled(1, 1.5)));
  EXPECT_FALSE(remains_spread(stays, scaled(1, -1)));
  EXPECT_FALSE(remains_spread(stays, LinearMap{}));
  LinearMap shear = stays;
  shear[1] = 0.8;
  EXPECT_FALSE(remains_spread(stays, shear)) << "it shrinks the diagonal";
  EXPECT_FALSE(remains_spread(stays, scaled(std::numeric_limits<double>::quiet_NaN(), 1)));
  EXPECT_FALSE(remains_spread(stays, scaled(1e300, 1)));
}

// Against the least stretch that is found by looking: never more is claimed.
TEST(RemainsSpread, IsTrueOfWhatItSays) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> uniform(-1, 1);
  int proved = 0;
  for (int run = 0; run < 400; ++run) {
    LinearMap ends[2] = {turn_about_z(90 * uniform(random)), turn_about_z(90 * uniform(random))};
    for (LinearMap& end : ends) {
      for (double& x : end) x += 0.2 * uniform(random);
    }
    if (!remains_spread(ends[0], ends[1])) continue;
    ++proved;
    for (int look = 0; look < 400; ++look) {
      const LinearMap m = between(ends[0], ends[1], 0.5 + 0.5 * uniform(random));
      const double v[3] = {uniform(random), uniform(random), uniform(random)};
      double before = 0;
      double after = 0;
      for (std::size_t row = 0; row < 3; ++row) {
        const double x = m[3 * row] * v[0] + m[3 * row + 1] * v[1] + m[3 * row + 2] * v[2];
        before += v[row] * v[row];
        after += x * x;
      }
      ASSERT_GT(after, kLeastStretch * kLeastStretch * before);
      ASSERT_LT(after, kMostStretch * kMostStretch * before);
    }
  }
  EXPECT_GT(proved, 40);
}

}  // namespace
}  // namespace warmfront

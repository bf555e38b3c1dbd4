// SPDX-License-Identifier: Apache-2.0
// Planes may separate only pairs without contact: compared with exact algebra on all fifteen feature pairs.
#include "engine/narrow_phase/triangle_filter.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <iterator>
#include <random>
#include <vector>

#include "engine/bounds/moving.h"
#include "engine/bounds/width.h"
#include "engine/elementary/certified.h"
#include "engine/elementary/exact.h"
#include "engine/elementary/query.h"
#include "engine/motion/motion.h"
#include "tests/unit/engine/moving_triangles.h"

namespace warmfront {
namespace {

using testing::any_contact;
using testing::kEight;
using testing::MovingTriangles;
using testing::near_each_other;
using testing::on_grid;
using testing::touching;
using testing::Triangles;

std::uint32_t parted(const std::array<MovingTriangles, kEight>& pairs, double separation = 0,
                     double tolerance = 1e-6) {
  const testing::EightPairs eight = testing::eight_pairs(pairs, separation);
  return triangles_apart(eight.pairs, eight.points, certified_reach(tolerance));
}

bool meet(const MovingTriangles& pair) {
  std::uint64_t exact_tests = 0;
  return any_contact(
      pair, [&](const FeatureVertices& features) { return exact_test(features, 1, exact_tests).contact; });
}

// Of any of the feature pairs.
double largest_size(const MovingTriangles& pair) {
  double largest = 0;
  any_contact(pair, [&](const FeatureVertices& features) {
    largest = std::max(largest, Query::prepare(features, 0).size);
    return false;
  });
  return largest;
}

void transform(MovingTriangles& pair, double offset, double scale) {
  for (Triangles* at : {&pair.t0, &pair.t1})
    for (auto& corner : *at)
      for (double& x : corner) x = (x + offset) * scale;
}

TEST(TriangleFilter, PlanesSeparateOnlyWhatExactAlgebraSeparates) {
  std::mt19937_64 random(31);
  int apart = 0;
  int near = 0;
  for (int trial = 0; trial < 2000; ++trial) {
    std::array<MovingTriangles, kEight> pairs;
    // Far from the origin, where coordinates keep few bits; tiny and huge.
    const double offset = trial % 3 == 0 ? std::ldexp(1.0, trial % 24) : 0;
    const double scale = trial % 5 == 0 ? std::ldexp(1.0, trial % 200 - 100) : 1;
    for (MovingTriangles& pair : pairs) {
      pair = near_each_other(random);
      transform(pair, offset, scale);
      if (trial % 7 == 0)  // from where they were, too, as far as numbers go
        for (auto& corner : pair.t1)
          for (double& x : corner) x = std::ldexp(x, trial % 100);
    }
    const std::uint32_t mask = parted(pairs);
    for (std::size_t i = 0; i < kEight; ++i) {
      const bool meets = meet(pairs[i]);
      (mask >> i & 1U) != 0 ? ++apart : ++near;
      ASSERT_FALSE(meets && (mask >> i & 1U) != 0) << trial << " pair " << i;
    }
  }
  EXPECT_GT(apart, 4000);
  EXPECT_GT(near, 3000);
}

// The second one falls past the first one's edge; while it does, they are so far apart.
MovingTriangles falling_past(std::mt19937_64& random, double distance) {
  MovingTriangles pair;
  const double turn = 3 * on_grid(random);
  const double tilt = on_grid(random);
  const double beside = distance / std::sqrt(1 + tilt * tilt);
  for (std::size_t k = 0; k < 6; ++k) {
    const bool second = k >= 3;
    // In the first one's frame, whose edge is the y axis.
    const double x = second ? beside + (k == 3 ? 0 : std::fabs(on_grid(random)))
                            : (k == 2 ? -0.25 - std::fabs(on_grid(random)) : 0);
    const double y = second ? 0.5 * on_grid(random) : (k == 0 ? -1 : (k == 1 ? 1 : on_grid(random)));
    const double high = second ? 0.5 + 0.25 * on_grid(random) : 0;
    const auto place = [&](double z) {
      const double u = x + tilt * z;
      return std::array{std::cos(turn) * u - std::sin(turn) * y, std::sin(turn) * u + std::cos(turn) * y,
                        z - tilt * x};
    };
    pair.t0[k] = place(high);
    pair.t1[k] = place(second ? high - 1.5 : 0);
  }
  return pair;
}

// Separated pairs are farther apart than a tier may report, so that the frame of the points does not matter.
TEST(TriangleFilter, PlanesSeparateNothingWithinReach) {
  std::mt19937_64 random(36);
  int apart = 0;
  int within = 0;
  for (int trial = 0; trial < 400; ++trial) {
    const double tolerance = trial % 2 == 0 ? 1e-6 : 0.003;
    const double separation = trial % 4 < 2 ? 0 : 0.05;
    const double reach = certified_reach(tolerance);
    std::array<MovingTriangles, kEight> pairs;
    std::array<double, kEight> distance;
    for (std::size_t i = 0; i < kEight; ++i) {
      distance[i] = separation + std::ldexp(reach, static_cast<int>(i) - 2);
      pairs[i] = falling_past(random, distance[i]);
    }
    const std::uint32_t mask = parted(pairs, separation, tolerance);
    for (std::size_t i = 0; i < kEight; ++i) {
      const bool beyond = distance[i] - separation > reach * largest_size(pairs[i]);
      within += !beyond;
      apart += static_cast<int>(mask >> i & 1U);
      ASSERT_TRUE(beyond || (mask >> i & 1U) == 0) << trial << " pair " << i;
    }
  }
  EXPECT_GT(apart, 200);
  EXPECT_GT(within, 200);
}

TEST(TriangleFilter, PlanesSeparateNothingThatTouches) {
  std::mt19937_64 random(32);
  for (int trial = 0; trial < 3000; ++trial) {
    std::array<MovingTriangles, kEight> pairs;
    const double offset = trial % 2 == 0 ? 0 : std::ldexp(1.0, trial % 20);
    for (MovingTriangles& pair : pairs) {
      pair = touching(random);
      transform(pair, offset, 1);
    }
    ASSERT_EQ(parted(pairs), 0U) << trial;
  }
}

// One above the other, both falling and gliding past each other: only planes along the motion, or along the
// triangles, are between them.
TEST(TriangleFilter, SeparationIsKept) {
  std::mt19937_64 random(33);
  for (int trial = 0; trial < 500; ++trial) {
    constexpr double kSeparation = 0.125;
    std::array<MovingTriangles, kEight> pairs;
    for (std::size_t i = 0; i < kEight; ++i) {
      const double between = kSeparation * (i % 2 == 0 ? 1.0001 : 0.9999);
      const double tilt = on_grid(random);
      const double norm = std::sqrt(1 + tilt * tilt);
      for (std::size_t k = 0; k < 6; ++k) {
        const double x = on_grid(random);
        const double y = on_grid(random);
        const double up = k < 3 ? 0 : between;
        pairs[i].t0[k] = {x - up * tilt / norm, y, tilt * x + up / norm};
        const double glide = k < 3 ? 0.5 : -0.5;
        pairs[i].t1[k] = {pairs[i].t0[k][0] + glide, y - 3, pairs[i].t0[k][2] + tilt * glide - 1};
      }
    }
    ASSERT_EQ(parted(pairs, kSeparation) & 0xaaU, 0U) << trial;
    ASSERT_EQ(parted(pairs, 0.9 * kSeparation), 0xffU) << trial;
  }
}

// Faster than they are large, so that no plane along either is between them at both ends.
TEST(TriangleFilter, RejectsTrianglesThatPassEachOtherFast) {
  std::mt19937_64 random(34);
  int apart = 0;
  for (int trial = 0; trial < 200; ++trial) {
    std::array<MovingTriangles, kEight> pairs;
    for (MovingTriangles& pair : pairs) {
      for (std::size_t k = 0; k < 6; ++k) {
        const bool second = k >= 3;
        pair.t0[k] = {on_grid(random) + (second ? 2.5 : 0), on_grid(random),
                      on_grid(random) - (second ? 8 : 0)};
        pair.t1[k] = pair.t0[k];
        if (second) pair.t1[k][2] += 16;
      }
    }
    apart += std::popcount(parted(pairs));
  }
  EXPECT_EQ(apart, 200 * static_cast<int>(kEight));
}

// However far points are from the frame, no overflow is taken for a gap: a corner in common is none.
TEST(TriangleFilter, OverflowingNumbersSeparateNothing) {
  std::mt19937_64 random(37);
  EightTrianglePairs eight;
  std::array<PointBounds, 6 * kEight> points;
  for (int trial = 0; trial < 5000; ++trial) {
    const float scale = std::ldexp(1.0F, trial % 100);
    for (std::uint32_t p = 0; p < points.size(); ++p) {
      eight.vertex[p % 6][p / 6] = p;
      for (auto& at : points[p].at) {
        for (std::size_t axis = 0; axis < 3; ++axis) at[axis] = scale * static_cast<float>(on_grid(random));
        at[3] = 0x1p-21F * scale;
      }
      if (p % 6 == 3) points[p] = points[p - 3];
    }
    ASSERT_EQ(triangles_apart(eight, points, certified_reach(1e-6)), 0U) << trial;
  }
}

TEST(TriangleFilter, WhatIsBeyondTheFrameIsNotSeparated) {
  std::mt19937_64 random(35);
  std::array<MovingTriangles, kEight> pairs;
  for (MovingTriangles& pair : pairs) {
    pair = near_each_other(random);
    for (auto& corner : pair.t1) corner[0] = 1e35;
  }
  EXPECT_EQ(parted(pairs), 0U);
}

}  // namespace
}  // namespace warmfront

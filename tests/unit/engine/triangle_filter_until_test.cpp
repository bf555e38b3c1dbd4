// SPDX-License-Identifier: Apache-2.0
// Planes up to a time within the step: what they separate is reported later, if at all.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <random>

#include "engine/elementary/certified.h"
#include "engine/elementary/elementary_test.h"
#include "engine/narrow_phase/triangle_filter.h"
#include "tests/unit/engine/moving_triangles.h"

namespace warmfront {
namespace {

using testing::kEight;
using testing::MovingTriangles;

std::uint32_t parted_until(const std::array<MovingTriangles, kEight>& pairs,
                           const std::array<float, kEight>& until, double separation, double tolerance) {
  testing::EightPairs eight = testing::eight_pairs(pairs, separation);
  eight.pairs.until = until;
  return triangles_apart_until(eight.pairs, eight.points, certified_reach(tolerance));
}

// The least toi of any pair of features; 2 without a contact. Counts those whose budget ended.
double reported(const MovingTriangles& pair, const ElementaryOptions& options, int& budgets) {
  double least = 2;
  ElementaryCounts counts;
  testing::any_contact(pair, [&](const FeatureVertices& features) {
    const Verdict verdict = elementary_test(features, options, counts);
    if (verdict.contact) least = std::min(least, verdict.toi);
    budgets += verdict.contact && verdict.status == ContactStatus::kBudget;
    return false;
  });
  return least;
}

// Also where a budget ends: so no answer depends on what was found earlier.
TEST(TriangleFilterUntil, WhatIsRemovedIsReportedLater) {
  std::mt19937_64 random(41);
  int removed = 0;
  int reported_later = 0;
  int left = 0;
  int budgets = 0;
  for (int trial = 0; trial < 3000; ++trial) {
    std::array<MovingTriangles, kEight> pairs;
    std::array<float, kEight> until;
    for (std::size_t i = 0; i < kEight; ++i) {
      pairs[i] = trial % 3 == 0 ? testing::touching(random) : testing::near_each_other(random);
      // Now and then a little before the contact, and at times no early one at all.
      until[i] = trial % 5 == 0 ? std::ldexp(1.0F, -static_cast<int>(random() % 24))
                                : static_cast<float>(random() % 1000) / 1000;
    }
    const double separation = trial % 4 < 2 ? 0 : 0.05;
    const double tolerance = trial % 2 == 0 ? 1e-12 : 0.01;
    ElementaryOptions options{.tier = trial % 7 == 0 ? Tier::kExact : Tier::kCertified,
                              .tolerance = tolerance,
                              .min_separation = separation};
    options.budget = trial % 7 < 5 ? static_cast<std::uint32_t>(random() % 3) : 512;
    for (std::size_t i = 0; i < kEight; ++i) {
      if (trial % 6 != 0) continue;
      const double toi = reported(pairs[i], options, budgets);
      if (toi > 0 && toi < 1)
        until[i] = static_cast<float>(toi * (1 - std::ldexp(1.0, -static_cast<int>(random() % 12))));
    }
    const std::uint32_t mask = parted_until(pairs, until, separation, tolerance);
    for (std::size_t i = 0; i < kEight; ++i) {
      if ((mask >> i & 1U) == 0) {
        ++left;
        continue;
      }
      ++removed;
      const double toi = reported(pairs[i], options, budgets);
      reported_later += toi <= 1;
      ASSERT_GT(toi, double{until[i]}) << trial << " pair " << i;
    }
  }
  EXPECT_GT(removed, 5000);
  EXPECT_GT(reported_later, 1000);
  EXPECT_GT(left, 1000);
  EXPECT_GT(budgets, 5000);
}

// On either side of some plane, so far from each other.
MovingTriangles beside(std::mt19937_64& random, double apart) {
  MovingTriangles pair = testing::near_each_other(random);
  const std::array<double, 3> n{testing::on_grid(random), testing::on_grid(random), testing::on_grid(random)};
  const auto along = [&](std::size_t k) {
    return n[0] * pair.t0[k][0] + n[1] * pair.t0[k][1] + n[2] * pair.t0[k][2];
  };
  const double length = std::sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
  const double up = std::max({along(0), along(1), along(2)}) - std::min({along(3), along(4), along(5)});
  for (std::size_t k = 3; k < 6; ++k) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double shift = (up + apart * length) * n[axis] / (length * length);
      pair.t0[k][axis] += shift;
      pair.t1[k][axis] += shift;
    }
  }
  return pair;
}

// By the separating axis theorem what hardly moves and is apart always has such a plane.
TEST(TriangleFilterUntil, WhatIsApartIsRemoved) {
  std::mt19937_64 random(42);
  std::array<float, kEight> until;
  until.fill(0x1p-16F);
  for (int trial = 0; trial < 1000; ++trial) {
    std::array<MovingTriangles, kEight> pairs;
    for (MovingTriangles& pair : pairs) pair = beside(random, 0.01);
    ASSERT_EQ(parted_until(pairs, until, 0, 1e-6), 0xffU) << trial;
  }
}

}  // namespace
}  // namespace warmfront

// SPDX-License-Identifier: Apache-2.0
// Commits of part of a motion round, and what is asked to stay apart by more than that is never taken
// through.
#include "engine/part_way.h"

#include <gmpxx.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>
#include <random>
#include <span>
#include <vector>

#include "engine/collider.h"
#include "tests/support/workers.h"

namespace warmfront {
namespace {

// On which side of the face of vertices 0 to 2 vertex 3 is.
int side(std::span<const double> positions) {
  const auto from_first = [&](std::size_t v, std::size_t axis) {
    return mpq_class(mpq_class(positions[3 * v + axis]) - mpq_class(positions[axis]));
  };
  const auto minor = [&](std::size_t i, std::size_t j) {
    return mpq_class(from_first(1, i) * from_first(2, j) - from_first(1, j) * from_first(2, i));
  };
  const mpq_class volume =
      minor(1, 2) * from_first(3, 0) + minor(2, 0) * from_first(3, 1) + minor(0, 1) * from_first(3, 2);
  return sgn(volume);
}

// A vertex above a face, and below it at the end, all of which move, far from the origin.
struct Fall {
  std::vector<double> start, end;

  Fall(std::mt19937& random, double away, bool single) {
    std::uniform_real_distribution<double> some(-0.1, 0.1);
    const double corners[] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0.3, 0.3, 0.5};
    for (std::size_t i = 0; i < std::size(corners); ++i) {
      start.push_back(away + corners[i] + some(random));
      end.push_back(away + corners[i] + some(random) + (i == 5 || i == 8 ? 0.3 : i == 11 ? -1 : 0));
      if (!single) continue;
      start.back() = static_cast<float>(start.back());
      end.back() = static_cast<float>(end.back());
    }
  }
  double largest() const {
    double most = 0;
    for (const auto* positions : {&start, &end}) {
      for (const double x : *positions) most = std::max(most, std::abs(x));
    }
    return most;
  }
};

// Goes a share of what is left of the way, until nothing is; is the vertex on the other side then?
bool is_taken_through(const Fall& fall, double separation, double share, Tier tier, Rounding rounding) {
  SceneDescription description{4, {{0, 1, 2}}, {{"", 0, 3}, {"", 3, 1}}};
  Collider collider =
      Collider::create(std::make_shared<const Scene>(Scene::create(std::move(description)).value()),
                       std::span<const double>(fall.start), {.tier = tier}, testing::workers())
          .value();
  const int before = side(fall.start);
  for (int i = 0; i < 60; ++i) {
    const double fraction =
        collider.max_step(std::span<const double>(fall.end), false, {.min_separation = separation})
            .value()
            .fraction;
    if (fraction == 0 || fraction == 1) break;
    EXPECT_TRUE(collider.commit(share * fraction, rounding).ok());
    if (side(collider.positions()) != before) return true;
  }
  return side(collider.positions()) != before;
}

TEST(PartWay, WhatStaysApartByMoreThanItsRoundingsIsNeverTakenThrough) {
  int without = 0;
  for (const Rounding rounding : {Rounding::kFloat32, Rounding::kFloat64}) {
    const bool single = rounding == Rounding::kFloat32;
    for (const Tier tier : {Tier::kCertified, Tier::kExact}) {
      for (const double away : {0.0, 100.0, 1e4}) {
        for (const double share : {0.5, 0.9, 1.0}) {
          std::mt19937 random(17);
          for (int trial = 0; trial < 8; ++trial) {
            const Fall fall(random, away, single);
            const double separation = fall.largest() * (single ? 0x1p-22 : 0x1p-48);
            ASSERT_FALSE(is_taken_through(fall, separation, share, tier, rounding))
                << single << ' ' << away << ' ' << share << ' ' << trial;
            without += is_taken_through(fall, 0, share, tier, rounding) ? 1 : 0;
          }
        }
      }
    }
  }
  EXPECT_GT(without, 50);
}

}  // namespace
}  // namespace warmfront

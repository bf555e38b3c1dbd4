// SPDX-License-Identifier: Apache-2.0
// What flies past in a small part of the step: the earliest contact is the first of all contacts, whatever
// was found before it.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <memory>
#include <random>
#include <span>
#include <vector>

#include "engine/collider.h"
#include "tests/support/scenes.h"

namespace warmfront {
namespace {

struct Sheets {
  testing::Faces faces;
  std::vector<double> start;
  std::vector<double> end;

  // A square of side `size` with its lowest corner there, upright, that flies `way` towards -x; one diagonal
  // of its vertices sticks out by `bump`.
  void add(const std::array<double, 3>& at, double size, double way, double bump) {
    constexpr int kCells = 4;
    const auto first = static_cast<int>(start.size() / 3);
    for (auto face : testing::grid(kCells)) {
      for (int& v : face) v += first;
      faces.push_back(face);
    }
    for (int i = 0; i <= kCells; ++i) {
      for (int j = 0; j <= kCells; ++j) {
        const std::array<double, 3> x{at[0] + (i == j ? bump : 0), at[1] + size * i / kCells,
                                      at[2] + size * j / kCells};
        start.insert(start.end(), x.begin(), x.end());
        end.insert(end.end(), {x[0] - way, x[1], x[2]});
      }
    }
  }

  Collider collider(const ColliderOptions& options = {}) const {
    const auto scene = testing::make_scene(static_cast<std::uint32_t>(start.size() / 3), faces);
    return Collider::create(scene, std::span<const double>(start), options, std::make_shared<Workers>(1))
        .value();
  }
};

double first_of_all(const Sheets& sheets, const ColliderOptions& options = {}) {
  Collider collider = sheets.collider(options);
  const StepResult all = collider.trial(std::span<const double>(sheets.end)).value();
  double first = 2;
  for (const Contact& contact : all.contacts) first = std::min(first, contact.toi);
  return first;
}

// The first pair that is looked at meets at 0.05, the other at 0.005.
TEST(FastPassers, MaxStepKnowsTheSoonerOfTwoPairs) {
  Sheets sheets;
  sheets.add({0, 0, 0}, 1, 0, 0.1);
  sheets.add({2, 0, 0}, 1, 38, 0);
  sheets.add({0, 100, 0}, 1, 0, 0.1);
  sheets.add({0.6, 100, 0}, 1, 100, 0);
  const double first = first_of_all(sheets);
  EXPECT_NEAR(first, 0.005, 1e-6);
  Collider collider = sheets.collider();
  EXPECT_LE(collider.max_step(std::span<const double>(sheets.end)).value().fraction, first);
}

TEST(FastPassers, TheEarliestIsTheFirstOfAll) {
  std::mt19937 random(51);
  const auto draw = [&](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  };
  int met = 0;
  for (int trial = 0; trial < 600; ++trial) {
    Sheets sheets;
    const int pairs = 2 + trial % 5;
    for (int k = 0; k < pairs; ++k) {
      const double size = std::exp2(draw(-4, 0));
      const double gap = draw(0.01, 2);
      sheets.add({0, 20.0 * k, 0}, size, 0, 0.1 * gap);
      sheets.add({gap, 20.0 * k + draw(-0.5, 0.5) * size, draw(-0.5, 0.5) * size}, size,
                 std::exp2(draw(3, 10)), 0);
    }
    ColliderOptions options;
    options.find_bodies = trial % 3 == 0;
    options.bounds = trial % 2 == 0 ? BoundsKind::kKDop18 : BoundsKind::kAabb;
    if (trial % 7 == 0) options.tier = Tier::kExact;
    const double first = first_of_all(sheets, options);
    Collider limit = sheets.collider(options);
    EXPECT_LE(limit.max_step(std::span<const double>(sheets.end)).value().fraction, std::min(first, 1.0))
        << trial;
    options.report = Report::kEarliest;
    Collider earliest = sheets.collider(options);
    const auto answer = earliest.trial(std::span<const double>(sheets.end));
    EXPECT_EQ(answer.value().earliest_toi.value_or(2), first) << trial;
    met += first <= 1;
  }
  EXPECT_GT(met, 400);
}

}  // namespace
}  // namespace warmfront

// SPDX-License-Identifier: Apache-2.0
// The cache of stationary parts is bounded like the front, and is reused bit for bit.
#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <vector>

#include "engine/collider.h"
#include "tests/support/scenes.h"
#include "tests/support/workers.h"

namespace warmfront {
namespace {

using Doubles = std::span<const double>;

/// Two square grids of `cells` cells a side, one above the other, within a separation of many cells: far more
/// contacts than triangles, all of them stationary.
struct StackedGrids {
  explicit StackedGrids(int cells) {
    for (int grid = 0; grid < 2; ++grid) {
      const auto first = static_cast<std::int32_t>(x.size() / 3);
      for (auto face : testing::grid(cells)) {
        for (auto& v : face) v += first;
        description.faces.push_back(face);
      }
      for (int i = 0; i <= cells; ++i) {
        for (int j = 0; j <= cells; ++j) {
          x.push_back(i + 0.25 * grid);
          x.push_back(j + 0.125 * grid);
          x.push_back(0.5 * grid);
        }
      }
      description.bodies.push_back(
          {"", static_cast<std::uint32_t>(first), static_cast<std::uint32_t>(x.size() / 3) - first});
      description.bodies.back().self_collision = false;
    }
    description.vertex_count = static_cast<std::uint32_t>(x.size() / 3);
  }

  Collider collider(const ColliderOptions& options) const {
    auto scene = std::make_shared<const Scene>(Scene::create(description).value());
    return Collider::create(scene, Doubles(x), options, testing::workers()).value();
  }

  SceneDescription description;
  std::vector<double> x;
};

constexpr int kSteps = 5;

TEST(RestAnswers, CountKeepsHowManyAndNotWhich) {
  const StackedGrids grids(24);
  Collider all = grids.collider({.min_separation = 4});
  Collider count = grids.collider({.min_separation = 4, .report = Report::kCount});
  std::size_t listed = 0;
  for (int k = 0; k < kSteps; ++k) {
    const StepResult listing = all.step(Doubles(grids.x)).value();
    const StepResult counting = count.step(Doubles(grids.x)).value();
    listed = listing.contacts.size();
    EXPECT_EQ(counting.vf, listing.vf);
    EXPECT_EQ(counting.ee, listing.ee);
    EXPECT_EQ(counting.possible, listing.possible);
    EXPECT_EQ(counting.earliest_toi, listing.earliest_toi);
    EXPECT_EQ(counting.statistics.counts.contacts_kept, listing.statistics.counts.contacts_kept);
    EXPECT_EQ(counting.statistics.counts.triangle_pairs, listing.statistics.counts.triangle_pairs);
    EXPECT_EQ(counting.statistics.counts.elementary_tests,
              k < 1 ? listing.statistics.counts.elementary_tests : 0);
  }
  ASSERT_GT(listed, 100'000U);
  EXPECT_GT(all.memory_bytes(), listed * sizeof(Contact));
  EXPECT_LT(count.memory_bytes(), listed * sizeof(Contact) / 4);
}

// Beyond the cap they are worked out in every step instead, and the front stays.
TEST(RestAnswers, TheyCountTowardsTheFrontsCap) {
  const StackedGrids grids(24);
  for (const Report report : {Report::kAll, Report::kCount, Report::kEarliest}) {
    Collider free = grids.collider({.min_separation = 4, .report = report});
    const std::size_t cap = free.step(Doubles(grids.x)).value().statistics.counts.front_pairs * 64 + 4096;
    Collider capped = grids.collider({.min_separation = 4, .report = report, .max_front_bytes = cap});
    for (int k = 0; k < kSteps; ++k) {
      const StepResult expected = free.step(Doubles(grids.x)).value();
      const StepResult step = capped.step(Doubles(grids.x)).value();
      EXPECT_TRUE(std::ranges::equal(step.contacts, expected.contacts));
      EXPECT_EQ(step.vf, expected.vf);
      EXPECT_EQ(step.ee, expected.ee);
      EXPECT_EQ(step.possible, expected.possible);
      EXPECT_EQ(step.earliest_toi, expected.earliest_toi);
      EXPECT_EQ(step.statistics.counts.triangle_pairs, expected.statistics.counts.triangle_pairs);
      EXPECT_LE(step.statistics.counts.front_bytes, 2 * cap) << "vectors' capacities, and chunks";
      EXPECT_NE(step.statistics.front_state, FrontState::kCapped);
    }
  }
}

TEST(RestAnswers, ThoseThatAreTooManyForAnAnswerAreNotKept) {
  const StackedGrids grids(24);
  Collider collider = grids.collider({.min_separation = 4, .max_contacts = 1000});
  for (int k = 0; k < 2; ++k) {
    const auto refused = collider.step(Doubles(grids.x));
    ASSERT_FALSE(refused.ok());
    EXPECT_EQ(refused.error().code, ErrorCode::kResourceExhausted);
  }
  EXPECT_LT(collider.memory_bytes(), std::size_t{4} << 20);
}

}  // namespace
}  // namespace warmfront

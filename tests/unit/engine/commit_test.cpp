// SPDX-License-Identifier: Apache-2.0
// Questions after a commit: what is kept between them counts from where the trial began, and must not be
// believed where the commit led beyond it.
#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <tuple>
#include <vector>

#include "engine/collider.h"

namespace warmfront {
namespace {

using Doubles = std::span<const double>;

/// `bodies` square grids of `side` vertices a side above each other; each is a long strip, whose end is
/// folded over its beginning, where `folded`.
struct Sheets {
  std::uint32_t side;
  int bodies;
  bool folded;

  SceneDescription scene() const {
    SceneDescription scene;
    const std::uint32_t each = side * side;
    scene.vertex_count = each * static_cast<std::uint32_t>(bodies);
    for (std::uint32_t b = 0; b < static_cast<std::uint32_t>(bodies); ++b) {
      for (std::uint32_t y = 0; y + 1 < side; ++y) {
        for (std::uint32_t x = 0; x + 1 < side; ++x) {
          const auto v = static_cast<std::int32_t>(b * each + y * side + x);
          const auto s = static_cast<std::int32_t>(side);
          scene.faces.push_back({v, v + 1, v + s});
          scene.faces.push_back({v + 1, v + s + 1, v + s});
        }
      }
    }
    return scene;
  }
  /// Of what is above the rest at `height` and 0.1 around it.
  std::vector<double> at(double height) const {
    std::vector<double> positions;
    for (int b = 0; b < bodies; ++b) {
      for (std::uint32_t y = 0; y < side; ++y) {
        for (std::uint32_t x = 0; x < side; ++x) {
          const double along = x, end = folded ? side / 2.0 : 2.0 * side;
          const bool over = along > end;
          positions.push_back((over ? 2 * end - along : along) + 0.17 * b);
          positions.push_back(y + 0.23 * b + (over ? 0.31 : 0.0));
          const double lift = over ? std::min(1.0, (along - end) / 3) : static_cast<double>(b);
          positions.push_back(lift * height + 0.05 * std::sin(0.7 * x + 1.3 * y + b));
        }
      }
    }
    return positions;
  }
};

class Commits : public ::testing::TestWithParam<std::tuple<double, bool, std::uint32_t, FrontMode>> {};

TEST_P(Commits, ToAndFroFindWhatAFreshColliderFinds) {
  const auto [fraction, folded, leaf_size, front] = GetParam();
  const Sheets sheets{14, folded ? 1 : 2, folded};
  ColliderOptions options;
  options.leaf_size = leaf_size;
  options.front = front;
  const auto scene = std::make_shared<const Scene>(Scene::create(sheets.scene()).value());
  const auto workers = std::make_shared<Workers>(1);
  Collider collider = Collider::create(scene, Doubles(sheets.at(0.5)), options, workers).value();
  std::size_t contacts = 0;
  for (int k = 1; k <= 12; ++k) {
    const std::vector<double> to = sheets.at(k % 2 == 0 ? 0.5 : -0.4);
    Collider fresh = Collider::create(scene, Doubles(collider.positions()), options, workers).value();
    const StepResult expected = fresh.step(Doubles(to)).value();
    const StepResult answer =
        k % 5 == 0 ? collider.step(Doubles(to)).value() : collider.trial(Doubles(to)).value();
    ASSERT_EQ(answer.vf, expected.vf) << "question " << k;
    ASSERT_EQ(answer.ee, expected.ee) << "question " << k;
    ASSERT_EQ(answer.earliest_toi, expected.earliest_toi) << "question " << k;
    contacts += answer.contacts.size();
    if (k % 5 != 0) {
      ASSERT_TRUE(collider.commit(fraction).ok());
    }
    ASSERT_TRUE(collider.self_check().ok());
  }
  EXPECT_GT(contacts, 1000u);
}

INSTANTIATE_TEST_SUITE_P(Of, Commits,
                         ::testing::Combine(::testing::Values(1.0, 0.9), ::testing::Bool(),
                                            ::testing::Values(4u, 64u),
                                            ::testing::Values(FrontMode::kWarm, FrontMode::kPaper)));

}  // namespace
}  // namespace warmfront

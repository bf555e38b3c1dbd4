// SPDX-License-Identifier: Apache-2.0
// A body goes far away in a trial: all bounds are wider then, also of two others that rest near each other,
// whose front is that of the narrower ones. The self-check took the difference for damage, and ended the
// session.
#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <vector>

#include "engine/collider.h"
#include "tests/support/scenes.h"
#include "tests/support/workers.h"

namespace warmfront {
namespace {

TEST(FarTrial, LeavesWhatRestsSound) {
  constexpr int kSide = 6;
  constexpr std::uint32_t kVertices = (kSide + 1) * (kSide + 1);
  SceneDescription scene{2 * kVertices + 3, {}, {}};
  for (const int first : {0, static_cast<int>(kVertices)}) {
    for (const auto& [a, b, c] : testing::grid(kSide))
      scene.faces.push_back({a + first, b + first, c + first});
  }
  const auto last = static_cast<std::int32_t>(2 * kVertices);
  scene.faces.push_back({last, last + 1, last + 2});
  scene.bodies = {{"", 0, kVertices, BodyKind::kRigid},
                  {"", kVertices, kVertices, BodyKind::kStatic},
                  {"", 2 * kVertices, 3, BodyKind::kRigid}};
  for (int k = 0; k < 40; ++k) {
    // A sheet that dips through another one at one corner: no plane separates them.
    const double gap = std::exp2(-2 - 0.25 * k);
    std::vector<double> x;
    for (const int sheet : {0, 1}) {
      for (int i = 0; i <= kSide; ++i) {
        for (int j = 0; j <= kSide; ++j)
          x.insert(x.end(), {i + 0.4 * sheet, j + 0.3 * sheet, sheet == 1 ? 0 : i + j == 0 ? -0.5 : gap});
      }
    }
    x.insert(x.end(), {3, 3, 2, 4, 3, 2, 3, 4, 2});
    Collider collider = Collider::create(std::make_shared<const Scene>(Scene::create(scene).value()),
                                         std::span<const double>(x), {.leaf_size = 1}, testing::workers())
                            .value();
    for (int step = 0; step < 3; ++step) ASSERT_TRUE(collider.step(std::span<const double>(x)).ok());
    for (const double far : {1e3, 1e4, 1e5}) {
      std::vector<double> away = x;
      for (std::size_t i = x.size() - 9; i < x.size(); ++i) away[i] += far;
      for (int trial = 0; trial < 2; ++trial) {
        ASSERT_TRUE(collider.trial(std::span<const double>(trial == 0 ? away : x)).ok());
        const Status sound = collider.self_check();
        ASSERT_TRUE(sound.ok()) << gap << ' ' << far << ": " << sound.error().message;
      }
    }
  }
}

}  // namespace
}  // namespace warmfront

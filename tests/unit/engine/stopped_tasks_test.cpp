// SPDX-License-Identifier: Apache-2.0
// A question of much that ends early, at a limit or because it is cancelled, while several threads are at it:
// a thread that heard of it may go on with other tasks until all have. A daemon was ended by that.
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <memory>
#include <random>
#include <thread>
#include <vector>

#include "engine/collider.h"
#include "tests/support/scenes.h"

namespace warmfront {
namespace {

constexpr int kSide = 32;
constexpr int kSheets = 6;

/// Sheets a fifth of a cell apart: hundreds of thousands of pairs are within a separation.
struct Layers {
  SceneDescription scene;
  std::vector<double> x;

  Layers() {
    for (int sheet = 0; sheet < kSheets; ++sheet) {
      const auto first = static_cast<int>(x.size() / 3);
      for (int i = 0; i < kSide; ++i) {
        for (int k = 0; k < kSide; ++k) x.insert(x.end(), {i / 20.0, k / 20.0, sheet / 100.0});
      }
      for (auto face : testing::grid(kSide - 1)) {
        for (auto& v : face) v += first;
        scene.faces.push_back(face);
      }
      scene.bodies.push_back({"", static_cast<std::uint32_t>(first), kSide * kSide});
    }
    scene.vertex_count = static_cast<std::uint32_t>(x.size() / 3);
  }
};

class StoppedTasks : public ::testing::Test {
 protected:
  std::vector<double> shaken() {
    std::normal_distribution<double> way(0, 0.02);
    std::vector<double> y = layers_.x;
    for (double& coordinate : y) coordinate += way(random_);
    return y;
  }
  Collider make() {
    return Collider::create(std::make_shared<const Scene>(Scene::create(layers_.scene).value()),
                            std::span<const double>(layers_.x), {.min_separation = 0.05},
                            std::make_shared<Workers>(4))
        .value();
  }

  Layers layers_;
  std::mt19937 random_{1};
};

TEST_F(StoppedTasks, AtALimit) {
  Collider collider = make();
  for (int i = 0; i < 24; ++i) {
    const std::vector<double> y = shaken();
    const double most = std::pow(10, std::uniform_real_distribution<double>(0, 5.5)(random_));
    const auto limited =
        collider.trial(Frame(std::span<const double>(y)), {.max_contacts = static_cast<std::size_t>(most)});
    ASSERT_TRUE(limited.ok() || limited.error().code == ErrorCode::kResourceExhausted);
  }
  const std::vector<double> y = shaken();
  Collider other = make();
  const auto here = collider.trial(Frame(std::span<const double>(y)));
  const auto there = other.trial(Frame(std::span<const double>(y)));
  EXPECT_TRUE(std::ranges::equal(here.value().contacts, there.value().contacts));
}

TEST_F(StoppedTasks, WhenCancelled) {
  Collider collider = make();
  for (int i = 0; i < 16; ++i) {
    const std::vector<double> y = shaken();
    const std::chrono::microseconds after(std::uniform_int_distribution<int>(0, 60'000)(random_));
    std::atomic<bool> cancelled = false;
    std::jthread canceller([&] {
      std::this_thread::sleep_for(after);
      cancelled = true;
    });
    const auto stopped = collider.trial(Frame(std::span<const double>(y)), {}, &cancelled);
    ASSERT_TRUE(stopped.ok() || stopped.error().code == ErrorCode::kCancelled);
  }
}

}  // namespace
}  // namespace warmfront

// SPDX-License-Identifier: Apache-2.0
// A small scene that moves: two wavy grids, one passing back and forth through the other. Plain functions,
// thread-safe.
#pragma once

#include <cmath>
#include <cstdint>
#include <memory>
#include <vector>

#include "engine/collider.h"
#include "engine/contact_hash.h"

namespace warmfront::test {

class MovingGrids {
 public:
  /// Two grids of `side` x `side` vertices.
  explicit MovingGrids(std::uint32_t side, double phase = 0) : side_(side), phase_(phase) {}

  std::uint32_t vertex_count() const { return 2 * side_ * side_; }

  SceneDescription scene() const {
    SceneDescription scene;
    scene.vertex_count = vertex_count();
    for (std::uint32_t grid = 0; grid < 2; ++grid) {
      for (std::uint32_t y = 0; y + 1 < side_; ++y) {
        for (std::uint32_t x = 0; x + 1 < side_; ++x) {
          const auto v = static_cast<std::int32_t>(grid * side_ * side_ + y * side_ + x);
          const auto s = static_cast<std::int32_t>(side_);
          scene.faces.push_back({v, v + 1, v + s});
          scene.faces.push_back({v + 1, v + s + 1, v + s});
        }
      }
    }
    return scene;
  }

  /// (n, 3) at a frame. From frame to frame one grid passes through the other, so that each step has
  /// contacts.
  std::vector<double> positions(std::uint64_t frame) const {
    std::vector<double> positions;
    const double t = static_cast<double>(frame);
    for (int grid = 0; grid < 2; ++grid) {
      for (std::uint32_t y = 0; y < side_; ++y) {
        for (std::uint32_t x = 0; x < side_; ++x) {
          const double side = frame % 2 == 0 ? 0.4 : -0.4;
          const double height = grid == 0 ? 0.0 : side + 0.1 * std::cos(0.9 * t + phase_);
          positions.push_back(x + 0.21 * grid);
          positions.push_back(y + 0.13 * grid);
          positions.push_back(height + 0.1 * std::sin(0.7 * x + 1.1 * y + 0.3 * t + phase_));
        }
      }
    }
    return positions;
  }

 private:
  std::uint32_t side_;
  double phase_;
};

/// The answers' fingerprint of frames first + 1 to last, computed in this process.
inline std::vector<std::uint64_t> local_hashes(const MovingGrids& grids, std::uint64_t first,
                                               std::uint64_t last) {
  auto scene = std::make_shared<const Scene>(Scene::create(grids.scene()).value());
  const std::vector<double> start = grids.positions(first);
  Collider collider =
      Collider::create(scene, std::span<const double>(start), {}, std::make_shared<Workers>(1)).value();
  std::vector<std::uint64_t> hashes;
  for (std::uint64_t frame = first + 1; frame <= last; ++frame) {
    const std::vector<double> positions = grids.positions(frame);
    const StepResult step = collider.step(std::span<const double>(positions)).value();
    ContactHash hash;
    hash.add_step(*scene, step.contacts);
    hashes.push_back(hash.value());
  }
  return hashes;
}

}  // namespace warmfront::test

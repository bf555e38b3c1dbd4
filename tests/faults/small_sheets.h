// SPDX-License-Identifier: Apache-2.0
// Two bodies, each a flat sheet of side 1 in n x n quads, and frames of them. Pure functions.
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "engine/scene.h"
#include "tests/support/operations.h"
#include "tests/support/poses.h"
#include "tests/support/scenes.h"

namespace warmfront::testing {

inline SceneDescription two_bodies(BodyKind first, BodyKind second, int n) {
  SceneDescription scene;
  const auto corners = static_cast<std::uint32_t>((n + 1) * (n + 1));
  for (int body = 0; body < 2; ++body) {
    for (auto face : grid(n)) {
      for (auto& v : face) v += body * static_cast<int>(corners);
      scene.faces.push_back(face);
    }
  }
  scene.vertex_count = 2 * corners;
  scene.bodies = {{"", 0, corners, first}, {"", corners, corners, second}};
  return scene;
}

inline std::vector<double> sheet(int n, double height) {
  std::vector<double> positions;
  for (int i = 0; i <= n; ++i) {
    for (int j = 0; j <= n; ++j) positions.insert(positions.end(), {1.0 * i / n, 1.0 * j / n, height});
  }
  return positions;
}

inline std::vector<double> joined(std::vector<double> a, const std::vector<double>& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

inline StepOperation posed(std::uint32_t body, const Pose& pose) {
  StepOperation step;
  step.poses.push_back({body, pose});
  return step;
}

inline StepOperation everything(std::vector<double> positions) {
  StepOperation step;
  step.all = std::move(positions);
  return step;
}

}  // namespace warmfront::testing

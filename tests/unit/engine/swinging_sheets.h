// SPDX-License-Identifier: Apache-2.0
// Sheets above each other that swing through each other with time.
#pragma once

#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include "engine/scene.h"

namespace warmfront::testing {

inline constexpr std::uint32_t kSheetSide = 12;
inline constexpr std::uint32_t kSheetVertices = kSheetSide * kSheetSide;

/// Sheets of kSheetSide by kSheetSide vertices above each other, which swing through each other with time.
inline SceneDescription swinging_sheets(int count, bool bodies) {
  SceneDescription scene;
  scene.vertex_count = kSheetVertices * static_cast<std::uint32_t>(count);
  for (std::uint32_t b = 0; b < static_cast<std::uint32_t>(count); ++b) {
    for (std::uint32_t y = 0; y + 1 < kSheetSide; ++y) {
      for (std::uint32_t x = 0; x + 1 < kSheetSide; ++x) {
        const auto v = static_cast<std::int32_t>(b * kSheetVertices + y * kSheetSide + x);
        const auto s = static_cast<std::int32_t>(kSheetSide);
        scene.faces.push_back({v, v + 1, v + s});
        scene.faces.push_back({v + 1, v + s + 1, v + s});
      }
    }
    if (!bodies) continue;
    Body body;
    body.first_vertex = b * kSheetVertices;
    body.vertex_count = kSheetVertices;
    scene.bodies.push_back(body);
  }
  return scene;
}

inline std::vector<double> swung(int count, double time, double offset = 0) {
  std::vector<double> positions;
  for (int b = 0; b < count; ++b) {
    for (std::uint32_t y = 0; y < kSheetSide; ++y) {
      for (std::uint32_t x = 0; x < kSheetSide; ++x) {
        positions.push_back(offset + x + 0.17 * b + 0.1 * std::sin(time + y));
        positions.push_back(y + 0.23 * b);
        positions.push_back(0.4 * b * std::cos(1.3 * time + 0.2 * x) +
                            0.05 * std::sin(0.7 * x + 1.3 * y + b + time));
      }
    }
  }
  return positions;
}

}  // namespace warmfront::testing

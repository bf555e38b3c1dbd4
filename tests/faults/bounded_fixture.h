// SPDX-License-Identifier: Apache-2.0
// Scenes that need much more work than their number of triangles suggests, on one thread.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "engine/collider.h"
#include "tests/support/hostile_scenes.h"

namespace warmfront::testing {

using Doubles = std::span<const double>;

inline const std::shared_ptr<Workers>& one_thread() {
  static const auto workers = std::make_shared<Workers>(1);
  return workers;
}

inline Collider make(const HostileScene& scene, const ColliderOptions& options) {
  auto shared = std::make_shared<const Scene>(Scene::create(scene.description).value());
  return Collider::create(shared, Doubles(scene.positions), options, one_thread()).value();
}

/// Sheets of n x n quads, one above the other along (1, 2, 3), which is no axis of bounds: these overlap, and
/// the sheets do not. The last two are at the same place.
inline HostileScene stacked_sheets(int bodies, int n, BodyKind kind) {
  HostileScene scene;
  const auto corners = static_cast<std::uint32_t>((n + 1) * (n + 1));
  for (int b = 0; b < bodies; ++b) {
    for (const auto& face : flat_grid(n).description.faces) {
      auto& added = scene.description.faces.emplace_back(face);
      for (auto& v : added) v += b * static_cast<int>(corners);
    }
    scene.description.bodies.push_back({"", b * corners, corners, kind});
    const double off = (b + 1 == bodies ? b - 1 : b) / 16384.0;
    for (int i = 0; i <= n; ++i) {
      for (int j = 0; j <= n; ++j)
        scene.positions.insert(scene.positions.end(),
                               {off + (2.0 * i + 3.0 * j) / n, 2 * off - 1.0 * i / n, 3 * off - 1.0 * j / n});
    }
  }
  scene.description.vertex_count = bodies * corners;
  return scene;
}

/// The same, side by side.
inline std::vector<double> spread(const HostileScene& scene) {
  std::vector<double> positions = scene.positions;
  for (const Body& body : scene.description.bodies) {
    for (std::uint32_t v = 0; v < body.vertex_count; ++v)
      positions[3 * (body.first_vertex + v) + 2] += 4.0 * body.first_vertex / body.vertex_count;
  }
  return positions;
}

inline HostileScene as_body(HostileScene scene, bool self_collision) {
  scene.description.bodies = {{"", 0, scene.description.vertex_count}};
  scene.description.bodies[0].self_collision = self_collision;
  return scene;
}

}  // namespace warmfront::testing

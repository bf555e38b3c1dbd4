// SPDX-License-Identifier: Apache-2.0
// WavySheets of triangles that turn as a whole or deform, for tests of what is found of bodies.
#pragma once

#include <cmath>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "engine/collider.h"
#include "tests/support/scenes.h"

namespace warmfront::testing {

/// `count` wavy sheets of n x n quads one beside the other.
struct WavySheets {
  WavySheets(int count, int n) : n(n) {
    for (int s = 0; s < count; ++s) {
      for (auto face : grid(n)) {
        for (auto& v : face) v += s * vertices();
        faces.push_back(face);
      }
      for (int i = 0; i <= n; ++i) {
        for (int j = 0; j <= n; ++j)
          x.insert(x.end(), {4.0 * s + i / 8.0, j / 8.0, 0.05 * std::sin(0.7 * i * j)});
      }
    }
    scene = make_scene(static_cast<std::uint32_t>(x.size() / 3), faces);
  }

  int vertices() const { return (n + 1) * (n + 1); }
  Collider collider(const ColliderOptions& options) const {
    return Collider::create(scene, std::span<const double>(x), options, std::make_shared<Workers>(2)).value();
  }
  // Sheet `s` turns about the z axis.
  void turn(int s, double angle) {
    for (int v = s * vertices(); v < (s + 1) * vertices(); ++v) {
      const double a = x[3 * v];
      const double b = x[3 * v + 1];
      x[3 * v] = std::cos(angle) * a - std::sin(angle) * b;
      x[3 * v + 1] = std::sin(angle) * a + std::cos(angle) * b;
    }
  }

  int n;
  testing::Faces faces;
  std::vector<double> x;
  std::shared_ptr<const Scene> scene;
};

}  // namespace warmfront::testing

// SPDX-License-Identifier: Apache-2.0
#include "tests/support/hostile_scenes.h"

#include <cmath>
#include <numbers>

#include "tests/support/scenes.h"

namespace warmfront::testing {

HostileScene collapsed_grid(int faces) {
  const int n = static_cast<int>(std::sqrt(faces / 2.0));
  HostileScene scene = flat_grid(n);
  std::fill(scene.positions.begin(), scene.positions.end(), 0.0);
  return scene;
}

HostileScene collapsed_strip(int n) {
  HostileScene scene;
  scene.description.vertex_count = static_cast<std::uint32_t>(n);
  for (int v = 0; v + 2 < n; ++v) scene.description.faces.push_back({v, v + 1, v + 2});
  scene.positions.assign(std::size_t{3} * scene.description.vertex_count, 0.0);
  return scene;
}

HostileScene coincident_triangles(int bodies, BodyKind kind) {
  HostileScene scene;
  for (int b = 0; b < bodies; ++b) {
    scene.description.faces.push_back({3 * b, 3 * b + 1, 3 * b + 2});
    scene.description.bodies.push_back({"", static_cast<std::uint32_t>(3 * b), 3, kind});
    scene.positions.insert(scene.positions.end(), {0, 0, 0, 1, 0, 0, 0, 1, 0});
  }
  scene.description.vertex_count = static_cast<std::uint32_t>(3 * bodies);
  return scene;
}

HostileScene fan(int faces) {
  HostileScene scene;
  scene.description.vertex_count = static_cast<std::uint32_t>(faces + 2);
  scene.positions = {0, 0, 0};
  for (int i = 0; i <= faces; ++i) {
    const double angle = 2 * std::numbers::pi * i / (faces + 1);
    scene.positions.insert(scene.positions.end(),
                           {std::cos(angle), std::sin(angle), i % 2 == 0 ? 0.0 : 1.0 / 16});
    if (i < faces) scene.description.faces.push_back({0, i + 1, i + 2});
  }
  return scene;
}

HostileScene book(int faces) {
  HostileScene scene;
  scene.description.vertex_count = static_cast<std::uint32_t>(faces + 2);
  scene.positions = {0, 0, 0, 0, 0, 1};
  for (int i = 0; i < faces; ++i) {
    const double angle = 2 * std::numbers::pi * i / faces;
    scene.positions.insert(scene.positions.end(), {std::cos(angle), std::sin(angle), 0.5});
    scene.description.faces.push_back({0, 1, i + 2});
  }
  return scene;
}

HostileScene flat_grid(int n) {
  HostileScene scene;
  scene.description.vertex_count = static_cast<std::uint32_t>((n + 1) * (n + 1));
  scene.description.faces = grid(n);
  for (int i = 0; i <= n; ++i) {
    for (int j = 0; j <= n; ++j)
      scene.positions.insert(scene.positions.end(), {static_cast<double>(i), static_cast<double>(j), 0.0});
  }
  return scene;
}

}  // namespace warmfront::testing

// SPDX-License-Identifier: Apache-2.0
// Scenes of random bodies that change, for tests that compare pair by pair. Used by one thread at a time.
#pragma once

#include <algorithm>
#include <cstdint>
#include <utility>
#include <vector>

#include "engine/scene.h"
#include "tests/support/draws.h"
#include "tests/support/scenes.h"

namespace warmfront::testing {

/// A description and where everything is, and what the description says of pairs of bodies.
class DrawnBodies : public Draws {
 public:
  explicit DrawnBodies(std::uint64_t seed) : Draws(seed) {}

 protected:
  /// One to three bodies, or a mesh without any.
  void draw_bodies() {
    const int bodies = below(3) == 0 ? 0 : 1 + below(3);
    for (int b = 0; b < std::max(1, bodies); ++b) {
      const auto [addition, rows] = draw_shape();
      append(addition, rows);
    }
    if (bodies == 0) description_.bodies.clear();
  }

  /// Any mesh, as a body of any kind but removed.
  std::pair<BodyAddition, std::vector<double>> draw_shape() {
    const RandomScene made = random_scene(random_);
    BodyAddition addition{{"", 0, made.scene->vertex_count(), static_cast<BodyKind>(below(3))}, {}};
    addition.body.self_collision = below(4) != 0;
    append_elements(*made.scene, 0, addition.faces, addition.edges);
    return {addition, made.positions};
  }

  /// It is there from now on.
  void append(BodyAddition addition, const std::vector<double>& rows) {
    for (auto face : addition.faces) {
      for (auto& v : face) v += static_cast<std::int32_t>(description_.vertex_count);
      description_.faces.push_back(face);
    }
    for (const auto& [a, b] : addition.edges) {
      const auto first = static_cast<std::int32_t>(description_.vertex_count);
      description_.edges.push_back({a + first, b + first});
    }
    addition.body.first_vertex = description_.vertex_count;
    description_.vertex_count += addition.body.vertex_count;
    description_.bodies.push_back(addition.body);
    x_.insert(x_.end(), rows.begin(), rows.end());
  }

  /// From where everything is; what is static stays.
  std::vector<double> draw_motion(const Scene& scene) {
    std::vector<double> y = random_motion(random_, scene, x_);
    for (const Body& body : description_.bodies) {
      if (body.kind != BodyKind::kStatic) continue;
      const auto first = static_cast<std::ptrdiff_t>(3 * body.first_vertex);
      std::copy_n(x_.begin() + first, 3 * body.vertex_count, y.begin() + first);
    }
    return y;
  }

  bool may_meet(std::uint32_t p, std::uint32_t q) const {
    if (description_.bodies.empty()) return true;
    const Body& a = description_.bodies[p];
    const Body& b = description_.bodies[q];
    if (p == q) return a.kind == BodyKind::kDeformable && a.self_collision;
    return a.kind != BodyKind::kStatic || b.kind != BodyKind::kStatic;
  }

  SceneDescription description_;
  std::vector<double> x_;
};

}  // namespace warmfront::testing

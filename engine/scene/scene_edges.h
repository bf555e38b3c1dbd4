// SPDX-License-Identifier: Apache-2.0
// The edges of a scene by their own type. A Scene, which the user sees, lists them as plain numbers: these
// become EdgeIds here. Pure functions.
#pragma once

#include <array>
#include <cstdint>
#include <ranges>
#include <span>

#include "engine/scene.h"
#include "engine/scene/numbers.h"

namespace warmfront {

/// Its two vertices.
inline const Edge& ends_of(const Scene& scene, EdgeId edge) {
  return scene.edges()[number_of(edge)];
}
/// As Scene::edge_faces().
inline std::span<const std::uint32_t> faces_along(const Scene& scene, EdgeId edge) {
  return scene.edge_faces()[number_of(edge)];
}

/// As Scene::face_edges().
inline EdgeId side_of(const Scene& scene, std::uint32_t face, int side) {
  return EdgeId{scene.face_edges()[face][side]};
}
inline std::array<EdgeId, 3> sides_of(const Scene& scene, std::uint32_t face) {
  const auto [a, b, c] = scene.face_edges()[face];
  return {EdgeId{a}, EdgeId{b}, EdgeId{c}};
}

/// Edges of a list of the scene's.
inline auto as_edges(std::span<const std::uint32_t> numbers) {
  return std::views::transform(numbers, [](std::uint32_t number) { return EdgeId{number}; });
}
inline auto lone_edges(const Scene& scene) {
  return as_edges(scene.lone_edges());
}
inline auto lone_edges_of(const Scene& scene, std::uint32_t vertex) {
  return as_edges(scene.lone_edges_of(vertex));
}

/// A range of vertices and of edges, for example of a body.
struct FeatureRange {
  std::uint32_t first_vertex = 0;
  std::uint32_t end_vertex = 0;
  EdgeId first_edge{0};
  EdgeId end_edge{0};
};

inline FeatureRange whole(const Scene& scene) {
  return {0, scene.vertex_count(), EdgeId{0}, EdgeId{scene.edge_count()}};
}
/// Vertices [first, end) and the edges between them, which are a range when the vertices are a body's.
FeatureRange features_of(const Scene& scene, std::uint32_t first_vertex, std::uint32_t end_vertex);

}  // namespace warmfront

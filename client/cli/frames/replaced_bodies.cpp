// SPDX-License-Identifier: Apache-2.0
#include "client/cli/frames/replaced_bodies.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <span>
#include <utility>
#include <variant>

namespace warmfront::client {
namespace {

/// The elements of the body, by vertices that count from its first.
template <std::size_t N>
std::vector<std::array<std::int32_t, N>> elements_of(const Body& body,
                                                     const std::vector<std::array<std::int32_t, N>>& all) {
  std::vector<std::array<std::int32_t, N>> own;
  for (std::array<std::int32_t, N> element : all) {
    const auto at = static_cast<std::uint32_t>(element[0]);
    if (at < body.first_vertex || at - body.first_vertex >= body.vertex_count) continue;
    for (std::int32_t& v : element) v -= static_cast<std::int32_t>(body.first_vertex);
    own.push_back(element);
  }
  return own;
}

BodyAddition mesh_of(const SceneDescription& scene, const Body& body) {
  BodyAddition mesh{body, elements_of(body, scene.faces), elements_of(body, scene.edges)};
  if (!scene.thickness.empty()) {
    const auto rows = std::span(scene.thickness).subspan(body.first_vertex, body.vertex_count);
    mesh.thickness.assign(rows.begin(), rows.end());
  }
  return mesh;
}

bool names_vertices(const PairFilters& filters) {
  return !filters.excluded_vertex_pairs.empty() || !filters.patches.empty() || !filters.rest_positions.empty();
}

/// But for their ranges of vertices.
bool said_alike(Body a, const Body& b) {
  a.first_vertex = b.first_vertex;
  a.vertex_count = b.vertex_count;
  return a == b;
}

}  // namespace

std::optional<std::vector<ReplacedBody>> replaced_bodies(const SceneDescription& from,
                                                         const SceneDescription& to) {
  const std::vector<Body>&before = from.bodies, &after = to.bodies;
  const bool alike = !after.empty() && from.thickness.empty() == to.thickness.empty() &&
                     from.excluded_pairs == to.excluded_pairs && from.filters == to.filters && !names_vertices(to.filters) &&
                     std::ranges::equal(before, after, said_alike);
  if (!alike) return std::nullopt;
  std::vector<ReplacedBody> replaced;
  for (std::size_t i = 0; i < after.size(); ++i) {
    const BodyAddition old = mesh_of(from, before[i]);
    BodyAddition mesh = mesh_of(to, after[i]);
    if (before[i].vertex_count == after[i].vertex_count && old.faces == mesh.faces && old.edges == mesh.edges &&
        old.thickness == mesh.thickness)
      continue;
    replaced.push_back({static_cast<std::uint32_t>(i), std::move(mesh), after[i].first_vertex});
  }
  return replaced;
}

Positions rows_of(const Positions& positions, std::uint32_t first, std::uint32_t count) {
  return std::visit(
      [&](auto values) { return Positions(values.subspan(3 * std::size_t{first}, 3 * std::size_t{count})); },
      positions);
}

}  // namespace warmfront::client

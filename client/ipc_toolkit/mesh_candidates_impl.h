// SPDX-License-Identifier: Apache-2.0
// The longer functions of MeshCandidates; included by mesh_candidates.h alone.
#pragma once

#include <string>

#include "client/ipc_toolkit/mesh_candidates.h"

namespace warmfront::ipc_toolkit {

namespace detail {

inline std::array<std::uint32_t, 2> in_order(std::array<std::int32_t, 2> edge) {
  const auto [lo, hi] = std::minmax(edge[0], edge[1]);
  return {static_cast<std::uint32_t>(lo), static_cast<std::uint32_t>(hi)};
}

/// By the scene's edges the caller's numbers, -1 for none; empty where an edge is listed twice.
inline std::vector<std::int32_t> numbers_of(std::span<const std::array<std::int32_t, 2>> edges,
                                            const Scene& scene) {
  std::vector<std::int32_t> number(scene.edge_count(), -1);
  for (std::size_t i = 0; i < edges.size(); ++i) {
    const auto found = std::ranges::lower_bound(scene.edges(), in_order(edges[i]));
    std::int32_t& of_edge = number[static_cast<std::size_t>(found - scene.edges().begin())];
    if (of_edge >= 0) return {};
    of_edge = static_cast<std::int32_t>(i);
  }
  return number;
}

}  // namespace detail

inline std::optional<MeshCandidates> MeshCandidates::create(Mesh mesh, std::shared_ptr<Workers> workers) {
  if (std::ranges::any_of(mesh.edges, [](const auto& edge) { return edge[0] == edge[1]; }))
    return std::nullopt;
  SceneDescription description;
  description.vertex_count = static_cast<std::uint32_t>(mesh.vertex_count);
  description.faces = mesh.faces;
  description.edges = mesh.edges;
  description.filters.patches = mesh.patches;
  auto scene = std::make_shared<const Scene>(value_or_throw(Scene::create(std::move(description))));
  std::vector<std::int32_t> edge_of = detail::numbers_of(mesh.edges, *scene);
  if (edge_of.empty() && !mesh.edges.empty()) return std::nullopt;
  return MeshCandidates(std::move(mesh), std::move(scene), std::move(edge_of), std::move(workers));
}

inline std::shared_ptr<const Scene> MeshCandidates::scene_of_points() const {
  SceneDescription description;
  description.vertex_count = static_cast<std::uint32_t>(mesh_.vertex_count);
  description.bodies = {{.name = "points", .vertex_count = description.vertex_count}};
  description.filters.patches = mesh_.patches;
  return std::make_shared<const Scene>(value_or_throw(Scene::create(std::move(description))));
}

// Edges as a body of their own, so that each meets every point and no other edge: a scene's edges do not meet
// the ends of others, whose own edges speak for them.
inline std::shared_ptr<const Scene> MeshCandidates::scene_of_points_and_edges() {
  const auto n = static_cast<std::uint32_t>(mesh_.vertex_count);
  std::vector<std::int32_t> copy_of(n, -1);
  edge_vertices_.clear();
  SceneDescription description;
  for (const auto& edge : mesh_.edges) {
    std::array<std::int32_t, 2> copied{};
    for (std::size_t k = 0; k < 2; ++k) {
      std::int32_t& copy = copy_of[static_cast<std::size_t>(edge[k])];
      if (copy < 0) {
        copy = static_cast<std::int32_t>(n + edge_vertices_.size());
        edge_vertices_.push_back(edge[k]);
      }
      copied[k] = copy;
    }
    description.edges.push_back(copied);
  }
  const auto copies = static_cast<std::uint32_t>(edge_vertices_.size());
  description.vertex_count = n + copies;
  description.bodies = {
      {.name = "points", .vertex_count = n, .self_collision = false},
      {.name = "edges", .first_vertex = n, .vertex_count = copies, .self_collision = false}};
  if (!mesh_.patches.empty()) {
    description.filters.patches = mesh_.patches;
    for (const std::int32_t v : edge_vertices_)
      description.filters.patches.push_back(mesh_.patches[static_cast<std::size_t>(v)]);
  }
  const std::vector<std::array<std::int32_t, 2>> copied = description.edges;
  auto scene = std::make_shared<const Scene>(value_or_throw(Scene::create(std::move(description))));
  lone_edge_of_ = detail::numbers_of(copied, *scene);
  return scene;
}

inline std::vector<double> MeshCandidates::with_edges_vertices(std::span<const double> positions) const {
  std::vector<double> all(positions.begin(), positions.end());
  if (positions.empty()) return all;
  for (const std::int32_t v : edge_vertices_) {
    const auto at = positions.subspan(3 * static_cast<std::size_t>(v), 3);
    all.insert(all.end(), at.begin(), at.end());
  }
  return all;
}

template <class Take>
void MeshCandidates::edge_face(const Take& take) {
  if (mesh_.edges.empty() || mesh_.faces.empty()) return;
  const Scene& scene = elements_.collider->scene();
  std::vector<std::vector<std::int32_t>> edges_around(mesh_.vertex_count);
  for (std::size_t e = 0; e < mesh_.edges.size(); ++e)
    for (const std::int32_t v : mesh_.edges[e])
      edges_around[static_cast<std::size_t>(v)].push_back(static_cast<std::int32_t>(e));
  std::vector<std::array<std::int32_t, 2>> found;
  const auto tell = [&](std::int32_t e, std::uint32_t f) {
    if (e < 0) return;
    for (const std::int32_t v : mesh_.faces[f])
      if (v == mesh_.edges[static_cast<std::size_t>(e)][0] ||
          v == mesh_.edges[static_cast<std::size_t>(e)][1])
        return;
    found.push_back({e, static_cast<std::int32_t>(f)});
  };
  for (const Contact& pair : near_elements()) {
    if (pair.kind == ContactKind::kVertexFace) {
      for (const std::int32_t e : edges_around[pair.a]) tell(e, pair.b);
    } else if (pair.kind == ContactKind::kEdgeEdge) {
      for (const std::uint32_t f : scene.edge_faces()[pair.b]) tell(edge_of_[pair.a], f);
      for (const std::uint32_t f : scene.edge_faces()[pair.a]) tell(edge_of_[pair.b], f);
    }
  }
  elements_.known = std::nullopt;  // the next question's answer takes its place
  const Where where = asked_.end.empty() ? Where::kTrialEnd : Where::kBase;
  for (const Contact& pair : elements_.collider->intersections(where)) tell(edge_of_[pair.a], pair.b);
  std::ranges::sort(found);
  found.erase(std::unique(found.begin(), found.end()), found.end());
  for (const auto& [e, f] : found) take(e, f);
}

}  // namespace warmfront::ipc_toolkit

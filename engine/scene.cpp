// SPDX-License-Identifier: Apache-2.0
#include "engine/scene.h"

#include <algorithm>
#include <numeric>
#include <tuple>
#include <utility>

#include "engine/parallel/stoppable_loops.h"
#include "engine/scene/connectivity.h"
#include "engine/scene/description_checks.h"
#include "engine/scene/held_bytes.h"

namespace warmfront {

Result<Scene> Scene::create(SceneDescription description, StopSignal stop) {
  if (Status status = check_description(description, stop); !status) return status.error();
  Scene scene;
  Mesh& mesh = scene.own_mesh();
  mesh.vertex_count = description.vertex_count;
  mesh.faces.reserve(description.faces.size());
  in_pieces(0, description.faces.size(), stop, [&](std::size_t first, std::size_t end) {
    for (std::size_t f = first; f < end; ++f) {
      const auto& face = description.faces[f];
      mesh.faces.push_back({static_cast<std::uint32_t>(face[0]), static_cast<std::uint32_t>(face[1]),
                            static_cast<std::uint32_t>(face[2])});
    }
  });
  EdgeTable table = find_edges(mesh.faces, description.edges, stop);
  mesh.edges = std::move(table.edges);
  mesh.face_edges = std::move(table.face_edges);
  mesh.lone_edges = std::move(table.lone_edges);
  mesh.vertex_lone_edges = lone_edges_of_vertices(mesh.edges, mesh.lone_edges, mesh.vertex_count, stop);
  mesh.vertex_faces = invert(mesh.faces, mesh.vertex_count, stop);
  mesh.edge_faces = invert(mesh.face_edges, mesh.edges.size(), stop);
  in_pieces(0, mesh.vertex_count, stop, [&](std::size_t first, std::size_t end) {
    for (std::size_t v = first; v < end; ++v)
      if (scene.is_isolated(static_cast<std::uint32_t>(v)))
        mesh.isolated_vertices.push_back(static_cast<std::uint32_t>(v));
  });
  for (const double thickness : description.thickness)
    mesh.most_thickness = std::max(mesh.most_thickness, thickness);
  if (mesh.most_thickness > 0) mesh.thickness = std::move(description.thickness);
  if (Status status = scene.take_bodies(description, stop); !status) return status.error();
  if (description.filters.any())
    scene.filters_ = std::make_shared<const PairFilters>(std::move(description.filters));
  return scene;
}

const PairFilters& Scene::filters() const {
  static const PairFilters none;
  return filters_ != nullptr ? *filters_ : none;
}

double most_thickness(std::span<const Body> bodies) {
  double most = 0;
  for (const Body& body : bodies)
    if (body.kind != BodyKind::kRemoved) most = std::max(most, body.thickness);
  return most;
}

std::size_t screw_count(std::span<const Body> bodies) {
  return static_cast<std::size_t>(std::ranges::count_if(
      bodies, [](const Body& body) { return body.screw && body.kind != BodyKind::kRemoved; }));
}

std::size_t world_count(std::span<const Body> bodies) {
  std::vector<std::uint32_t> worlds;
  for (const Body& body : bodies) {
    if (body.kind != BodyKind::kRemoved && body.world != 0) worlds.push_back(body.world);
  }
  std::ranges::sort(worlds);
  return static_cast<std::size_t>(std::unique(worlds.begin(), worlds.end()) - worlds.begin());
}

double Scene::most_thickness() const {
  return warmfront::most_thickness(bodies_) + mesh_->most_thickness;
}

Status Scene::take_bodies(SceneDescription& description, StopSignal stop) {
  Mesh& mesh = own_mesh();
  bodies_ = std::move(description.bodies);
  excluded_pairs_ = std::move(description.excluded_pairs);
  if (bodies_.empty()) {
    mesh.body_of_vertex = connected_components(mesh.faces, mesh.edges, mesh.lone_edges, mesh.vertex_count,
                                               mesh.body_count, stop);
    return {};
  }
  mesh.body_count = static_cast<std::uint32_t>(bodies_.size());
  name_bytes_ = 0;
  mesh.body_of_vertex.clear();
  reserve(mesh.body_of_vertex, mesh.vertex_count, stop);
  PacedStop paced(stop);
  for (std::uint32_t b = 0; b < mesh.body_count; ++b) {
    paced.check();
    name_bytes_ += bodies_[b].name.size();
    lengthen(mesh.body_of_vertex, mesh.body_of_vertex.size() + bodies_[b].vertex_count, b, stop);
  }
  if (Status status = check_faces_of_bodies(mesh.faces, mesh.body_of_vertex, stop); !status) return status;
  return check_edges_of_bodies(mesh.edges, mesh.lone_edges, mesh.body_of_vertex, stop);
}

Result<Scene> Scene::with_bodies(std::vector<Body> bodies, StopSignal stop) const {
  SceneDescription description{vertex_count(), {}, std::move(bodies)};
  if (Status status = check_bodies(description, stop); !status) return status.error();
  Scene scene = *this;
  if (Status status = scene.take_bodies(description, stop); !status) return status.error();
  return scene;
}

std::array<std::uint32_t, 4> Scene::vertices_of(const Contact& contact) const {
  if (contact.kind == ContactKind::kVertexFace) {
    const Face& face = mesh_->faces[contact.b];
    return {contact.a, face[0], face[1], face[2]};
  }
  if (contact.kind == ContactKind::kVertexHalfSpace) return {contact.a, contact.a, contact.a, contact.b};
  const auto ends = [&](bool of_vertex, std::uint32_t number) {
    return of_vertex ? Edge{number, number} : mesh_->edges[number];
  };
  const Edge a = ends(contact.kind != ContactKind::kEdgeEdge, contact.a);
  const Edge b = ends(contact.kind == ContactKind::kVertexVertex, contact.b);
  return {a[0], a[1], b[0], b[1]};
}

std::array<std::uint32_t, 5> Scene::edge_face_vertices_of(const Contact& contact) const {
  const Edge& edge = mesh_->edges[contact.a];
  const Face& face = mesh_->faces[contact.b];
  return {edge[0], edge[1], face[0], face[1], face[2]};
}

std::size_t Scene::memory_bytes() const {
  return sizeof(*this) + sizeof(*mesh_) + mesh_->faces.capacity() * sizeof(Face) +
         mesh_->edges.capacity() * sizeof(Edge) +
         mesh_->face_edges.capacity() * sizeof(mesh_->face_edges[0]) + mesh_->vertex_faces.memory_bytes() +
         mesh_->edge_faces.memory_bytes() + mesh_->vertex_lone_edges.memory_bytes() +
         (mesh_->lone_edges.capacity() + mesh_->isolated_vertices.capacity() +
          mesh_->body_of_vertex.capacity()) *
             sizeof(std::uint32_t) +
         bodies_.capacity() * sizeof(Body) + name_bytes_ +
         excluded_pairs_.capacity() * sizeof(excluded_pairs_[0]) +
         held_bytes(filters().rest_positions, filters().excluded_vertex_pairs, filters().patches,
                    mesh_->thickness);
}

}  // namespace warmfront

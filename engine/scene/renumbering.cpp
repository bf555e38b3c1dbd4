// SPDX-License-Identifier: Apache-2.0
#include "engine/scene/renumbering.h"

#include <algorithm>

#include "engine/parallel/stoppable_loops.h"

namespace warmfront {
namespace {

constexpr std::uint32_t kUnnumbered = 0xffffffff;

// Appends the rows original[i], their items renamed.
void append_rows(const Csr& csr, std::span<const std::uint32_t> original,
                 std::span<const std::uint32_t> renamed, StopSignal stop, Csr& result) {
  const std::size_t first = result.rows();
  if (result.begin.empty()) result.begin.push_back(0);
  result.begin.reserve(original.size() + 1);
  for (std::size_t i = first; i < original.size(); ++i)
    result.begin.push_back(result.begin.back() + static_cast<std::uint32_t>(csr[original[i]].size()));
  result.items.resize(result.begin.back());
  for_each_index(first, original.size(), stop, [&](std::size_t i) {
    std::uint32_t* to = result.items.data() + result.begin[i];
    for (const std::uint32_t item : csr[original[i]]) *to++ = renamed[item];
  });
}

Csr renamed_items(Csr csr, std::span<const std::uint32_t> renamed) {
  for_each_index(0, csr.items.size(), {}, [&](std::size_t i) { csr.items[i] = renamed[csr.items[i]]; });
  return csr;
}

// Appends the rows that `result` lacks, in the same order.
void append_same_rows(const Csr& csr, std::span<const std::uint32_t> renamed, StopSignal stop, Csr& result) {
  const std::size_t first = result.items.size();
  result.begin.insert(result.begin.end(),
                      csr.begin.begin() + static_cast<std::ptrdiff_t>(result.begin.size()), csr.begin.end());
  result.items.resize(csr.items.size());
  for_each_index(first, csr.items.size(), stop,
                 [&](std::size_t i) { result.items[i] = renamed[csr.items[i]]; });
}

}  // namespace

void Renumbering::extend(const Scene& scene, std::span<const Primitive> order, StopSignal stop) {
  new_vertex_.resize(scene.vertex_count(), kUnnumbered);
  new_face_.resize(scene.face_count(), kUnnumbered);
  original_vertex_.reserve(scene.vertex_count());
  original_face_.reserve(scene.face_count());
  const auto meet = [this](std::uint32_t vertex) {
    if (new_vertex_[vertex] != kUnnumbered) return;
    new_vertex_[vertex] = static_cast<std::uint32_t>(original_vertex_.size());
    original_vertex_.push_back(vertex);
  };
  PacedStop paced(stop);
  for (const Primitive primitive : order) {
    paced.check();
    if ((primitive & kPoint) != 0) {
      meet(primitive & ~kPoint);
      continue;
    }
    new_face_[primitive] = static_cast<std::uint32_t>(original_face_.size());
    original_face_.push_back(primitive);
    for (const std::uint32_t vertex : scene.faces()[primitive]) meet(vertex);
  }
}

void Renumbering::extend(const Scene& scene, Scene& result, StopSignal stop) const {
  const Scene::Mesh& from = *scene.mesh_;
  Scene::Mesh& to = result.own_mesh();
  const std::size_t first_vertex = to.vertex_count;
  const std::size_t first_face = to.faces.size();
  const std::size_t first_edge = to.edges.size();
  to.vertex_count = from.vertex_count;
  to.body_count = from.body_count;
  to.faces.resize(scene.face_count());
  to.face_edges.resize(scene.face_count());
  for_each_index(first_face, original_face_.size(), stop, [&](std::size_t f) {
    const Face& face = from.faces[original_face_[f]];
    to.faces[f] = {new_vertex_[face[0]], new_vertex_[face[1]], new_vertex_[face[2]]};
    to.face_edges[f] = from.face_edges[original_face_[f]];
  });
  to.edges.resize(scene.edge_count());
  for_each_index(first_edge, to.edges.size(), stop, [&](std::size_t e) {
    to.edges[e] = {new_vertex_[from.edges[e][0]], new_vertex_[from.edges[e][1]]};
  });
  append_rows(from.vertex_faces, original_vertex_, new_face_, stop, to.vertex_faces);
  append_same_rows(from.edge_faces, new_face_, stop, to.edge_faces);
  to.body_of_vertex.reserve(scene.vertex_count());
  PacedStop paced(stop);
  for (std::size_t v = first_vertex; v < original_vertex_.size(); ++v) {
    paced.check();
    to.body_of_vertex.push_back(from.body_of_vertex[original_vertex_[v]]);
    if (from.vertex_faces[original_vertex_[v]].empty())
      to.isolated_vertices.push_back(static_cast<std::uint32_t>(v));
  }
}

Renumbering::Extent Renumbering::extent(const Scene& renumbered) {
  return {renumbered.vertex_count(), renumbered.face_count(), renumbered.edge_count(),
          renumbered.body_count()};
}

void Renumbering::truncate(const Extent& extent, Scene& scene) noexcept {
  Scene::Mesh& mesh = *scene.mesh_;  // not shared: it was extended
  const auto shorten = [](auto& list, std::size_t size) {
    list.erase(list.begin() + static_cast<std::ptrdiff_t>(std::min(size, list.size())), list.end());
  };
  const auto shorten_rows = [&](Csr& csr, std::size_t rows) {
    if (csr.begin.empty()) return;
    shorten(csr.begin, rows + 1);
    shorten(csr.items, csr.begin.back());
  };
  shorten(original_vertex_, extent.vertices);
  shorten(new_vertex_, extent.vertices);
  shorten(original_face_, extent.faces);
  shorten(new_face_, extent.faces);
  mesh.vertex_count = extent.vertices;
  mesh.body_count = extent.bodies;
  shorten(mesh.faces, extent.faces);
  shorten(mesh.face_edges, extent.faces);
  shorten(mesh.edges, extent.edges);
  shorten_rows(mesh.vertex_faces, extent.vertices);
  shorten_rows(mesh.edge_faces, extent.edges);
  shorten(mesh.body_of_vertex, extent.vertices);
  std::erase_if(mesh.isolated_vertices, [&](std::uint32_t v) { return v >= extent.vertices; });
}

Patches Renumbering::apply(const Patches& patches) const {
  Patches result;
  if (patches.of_face.empty()) return result;
  result.of_face.reserve(original_face_.size());
  for (const std::uint32_t f : original_face_) result.of_face.push_back(patches.of_face[f]);
  result.faces = renamed_items(patches.faces, new_face_);
  result.contours = renamed_items(patches.contours, new_vertex_);
  return result;
}

}  // namespace warmfront

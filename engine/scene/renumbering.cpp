// SPDX-License-Identifier: Apache-2.0
#include "engine/scene/renumbering.h"

#include <tbb/parallel_for.h>

#include <algorithm>

namespace warmfront {
namespace {

constexpr std::uint32_t kUnnumbered = 0xffffffff;

// Appends the rows original[i], their items renamed.
void append_rows(const Csr& csr, std::span<const std::uint32_t> original,
                 std::span<const std::uint32_t> renamed, Csr& result) {
  const std::size_t first = result.rows();
  if (result.begin.empty()) result.begin.push_back(0);
  result.begin.reserve(original.size() + 1);
  for (std::size_t i = first; i < original.size(); ++i)
    result.begin.push_back(result.begin.back() + static_cast<std::uint32_t>(csr[original[i]].size()));
  result.items.resize(result.begin.back());
  tbb::parallel_for(first, original.size(), [&](std::size_t i) {
    std::uint32_t* to = result.items.data() + result.begin[i];
    for (const std::uint32_t item : csr[original[i]]) *to++ = renamed[item];
  });
}

Csr renamed_items(Csr csr, std::span<const std::uint32_t> renamed) {
  tbb::parallel_for(std::size_t{0}, csr.items.size(),
                    [&](std::size_t i) { csr.items[i] = renamed[csr.items[i]]; });
  return csr;
}

// Appends the rows that `result` lacks, which keep their places.
void append_same_rows(const Csr& csr, std::span<const std::uint32_t> renamed, Csr& result) {
  const std::size_t first = result.items.size();
  result.begin.insert(result.begin.end(),
                      csr.begin.begin() + static_cast<std::ptrdiff_t>(result.begin.size()), csr.begin.end());
  result.items.resize(csr.items.size());
  tbb::parallel_for(first, csr.items.size(), [&](std::size_t i) { result.items[i] = renamed[csr.items[i]]; });
}

}  // namespace

void Renumbering::extend(const Scene& scene, std::span<const Primitive> order) {
  new_vertex_.resize(scene.vertex_count(), kUnnumbered);
  new_face_.resize(scene.face_count(), kUnnumbered);
  original_vertex_.reserve(scene.vertex_count());
  original_face_.reserve(scene.face_count());
  const auto meet = [this](std::uint32_t vertex) {
    if (new_vertex_[vertex] != kUnnumbered) return;
    new_vertex_[vertex] = static_cast<std::uint32_t>(original_vertex_.size());
    original_vertex_.push_back(vertex);
  };
  for (const Primitive primitive : order) {
    if ((primitive & kPoint) != 0) {
      meet(primitive & ~kPoint);
      continue;
    }
    new_face_[primitive] = static_cast<std::uint32_t>(original_face_.size());
    original_face_.push_back(primitive);
    for (const std::uint32_t vertex : scene.faces()[primitive]) meet(vertex);
  }
}

void Renumbering::extend(const Scene& scene, Scene& result) const {
  const std::size_t first_vertex = result.vertex_count_;
  const std::size_t first_face = result.faces_.size();
  const std::size_t first_edge = result.edges_.size();
  result.vertex_count_ = scene.vertex_count_;
  result.body_count_ = scene.body_count_;
  result.faces_.resize(scene.face_count());
  result.face_edges_.resize(scene.face_count());
  tbb::parallel_for(first_face, original_face_.size(), [&](std::size_t f) {
    const Face& face = scene.faces_[original_face_[f]];
    result.faces_[f] = {new_vertex_[face[0]], new_vertex_[face[1]], new_vertex_[face[2]]};
    result.face_edges_[f] = scene.face_edges_[original_face_[f]];
  });
  result.edges_.resize(scene.edge_count());
  tbb::parallel_for(first_edge, result.edges_.size(), [&](std::size_t e) {
    result.edges_[e] = {new_vertex_[scene.edges_[e][0]], new_vertex_[scene.edges_[e][1]]};
  });
  append_rows(scene.vertex_faces_, original_vertex_, new_face_, result.vertex_faces_);
  append_same_rows(scene.edge_faces_, new_face_, result.edge_faces_);
  result.body_of_vertex_.reserve(scene.vertex_count());
  for (std::size_t v = first_vertex; v < original_vertex_.size(); ++v) {
    result.body_of_vertex_.push_back(scene.body_of_vertex_[original_vertex_[v]]);
    if (scene.vertex_faces_[original_vertex_[v]].empty())
      result.isolated_vertices_.push_back(static_cast<std::uint32_t>(v));
  }
}

Renumbering::Extent Renumbering::extent(const Scene& renumbered) {
  return {renumbered.vertex_count_, renumbered.face_count(), renumbered.edge_count(), renumbered.body_count_};
}

void Renumbering::truncate(const Extent& extent, Scene& scene) noexcept {
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
  scene.vertex_count_ = extent.vertices;
  scene.body_count_ = extent.bodies;
  shorten(scene.faces_, extent.faces);
  shorten(scene.face_edges_, extent.faces);
  shorten(scene.edges_, extent.edges);
  shorten_rows(scene.vertex_faces_, extent.vertices);
  shorten_rows(scene.edge_faces_, extent.edges);
  shorten(scene.body_of_vertex_, extent.vertices);
  std::erase_if(scene.isolated_vertices_, [&](std::uint32_t v) { return v >= extent.vertices; });
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

// SPDX-License-Identifier: Apache-2.0
#include "engine/scene/renumbering.h"

#include <tbb/parallel_for.h>

namespace warmfront {
namespace {

constexpr std::uint32_t kUnnumbered = 0xffffffff;

// Row i of the result is row original[i], its items renamed by `renamed`.
Csr permuted(const Csr& csr, std::span<const std::uint32_t> original,
             std::span<const std::uint32_t> renamed) {
  Csr result;
  result.begin.reserve(original.size() + 1);
  result.begin.push_back(0);
  for (const std::uint32_t row : original)
    result.begin.push_back(result.begin.back() + static_cast<std::uint32_t>(csr[row].size()));
  result.items.resize(result.begin.back());
  tbb::parallel_for(std::size_t{0}, original.size(), [&](std::size_t i) {
    std::uint32_t* to = result.items.data() + result.begin[i];
    for (const std::uint32_t item : csr[original[i]]) *to++ = renamed[item];
  });
  return result;
}

Csr renamed_items(Csr csr, std::span<const std::uint32_t> renamed) {
  tbb::parallel_for(std::size_t{0}, csr.items.size(),
                    [&](std::size_t i) { csr.items[i] = renamed[csr.items[i]]; });
  return csr;
}

}  // namespace

Renumbering::Renumbering(const Scene& scene, std::span<const std::uint32_t> order)
    : new_vertex_(scene.vertex_count(), kUnnumbered), new_face_(scene.face_count(), kUnnumbered) {
  original_vertex_.reserve(scene.vertex_count());
  original_face_.reserve(scene.face_count());
  const auto meet = [this](std::uint32_t vertex) {
    if (new_vertex_[vertex] != kUnnumbered) return;
    new_vertex_[vertex] = static_cast<std::uint32_t>(original_vertex_.size());
    original_vertex_.push_back(vertex);
  };
  for (const std::uint32_t primitive : order) {
    if (primitive >= scene.face_count()) {
      meet(scene.isolated_vertices()[primitive - scene.face_count()]);
      continue;
    }
    new_face_[primitive] = static_cast<std::uint32_t>(original_face_.size());
    original_face_.push_back(primitive);
    for (const std::uint32_t vertex : scene.faces()[primitive]) meet(vertex);
  }
}

Scene Renumbering::apply(const Scene& scene) const {
  Scene result;
  result.vertex_count_ = scene.vertex_count_;
  result.body_count_ = scene.body_count_;
  result.faces_.resize(scene.face_count());
  result.face_edges_.resize(scene.face_count());
  tbb::parallel_for(std::size_t{0}, original_face_.size(), [&](std::size_t f) {
    const Face& face = scene.faces_[original_face_[f]];
    result.faces_[f] = {new_vertex_[face[0]], new_vertex_[face[1]], new_vertex_[face[2]]};
    result.face_edges_[f] = scene.face_edges_[original_face_[f]];
  });
  result.edges_.resize(scene.edge_count());
  tbb::parallel_for(std::size_t{0}, result.edges_.size(), [&](std::size_t e) {
    result.edges_[e] = {new_vertex_[scene.edges_[e][0]], new_vertex_[scene.edges_[e][1]]};
  });
  result.vertex_faces_ = permuted(scene.vertex_faces_, original_vertex_, new_face_);
  result.edge_faces_ = renamed_items(scene.edge_faces_, new_face_);
  result.body_of_vertex_.reserve(scene.vertex_count());
  for (const std::uint32_t v : original_vertex_) {
    result.body_of_vertex_.push_back(scene.body_of_vertex_[v]);
    if (scene.vertex_faces_[v].empty())
      result.isolated_vertices_.push_back(static_cast<std::uint32_t>(result.body_of_vertex_.size() - 1));
  }
  return result;
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

std::vector<std::uint32_t> Renumbering::apply(const Scene& scene,
                                              std::span<const std::uint32_t> order) const {
  // Both kinds of primitives are numbered in the order in which they are met.
  std::vector<std::uint32_t> result;
  result.reserve(order.size());
  std::uint32_t faces = 0;
  std::uint32_t points = scene.face_count();
  for (const std::uint32_t primitive : order)
    result.push_back(primitive < scene.face_count() ? faces++ : points++);
  return result;
}

}  // namespace warmfront

// SPDX-License-Identifier: Apache-2.0
#include "engine/scene/renumbering.h"

#include <algorithm>
#include <utility>

#include "engine/parallel/stoppable_loops.h"
#include "engine/scene/connectivity.h"
#include "engine/scene/primitives.h"

namespace warmfront {
namespace {

constexpr NewVertex kNoVertex{0xffffffff};
constexpr NewFace kNoFace{0xffffffff};

// Appends the rows given[i], their items renamed.
void append_rows(const Csr& csr, std::span<const GivenVertex> given, std::span<const NewFace> renamed,
                 StopSignal stop, Csr& result) {
  const std::size_t first = result.rows();
  if (result.begin.empty()) result.begin.push_back(0);
  result.begin.reserve(given.size() + 1);
  for (std::size_t i = first; i < given.size(); ++i)
    result.begin.push_back(result.begin.back() + static_cast<std::uint32_t>(csr[number_of(given[i])].size()));
  result.items.resize(result.begin.back());
  for_each_index(first, given.size(), stop, [&](std::size_t i) {
    std::uint32_t* to = result.items.data() + result.begin[i];
    for (const std::uint32_t item : csr[number_of(given[i])]) *to++ = number_of(renamed[item]);
  });
}

template <class New>
Csr renamed_items(Csr csr, const std::vector<New>& renamed) {
  for_each_index(0, csr.items.size(), {},
                 [&](std::size_t i) { csr.items[i] = number_of(renamed[csr.items[i]]); });
  return csr;
}

// Appends the rows that `result` lacks, in the same order.
void append_same_rows(const Csr& csr, std::span<const NewFace> renamed, StopSignal stop, Csr& result) {
  const std::size_t first = result.items.size();
  result.begin.insert(result.begin.end(),
                      csr.begin.begin() + static_cast<std::ptrdiff_t>(result.begin.size()), csr.begin.end());
  result.items.resize(csr.items.size());
  for_each_index(first, csr.items.size(), stop,
                 [&](std::size_t i) { result.items[i] = number_of(renamed[csr.items[i]]); });
}

}  // namespace

Renumbering::Renumbering(std::vector<GivenVertex> given_vertices) : given_vertex_(std::move(given_vertices)) {
  new_vertex_.resize(given_vertex_.size());
  for (std::size_t v = 0; v < given_vertex_.size(); ++v)
    new_vertex_[number_of(given_vertex_[v])] = NewVertex{static_cast<std::uint32_t>(v)};
}

Renumbering Renumbering::join(std::span<const Slice> slices, StopSignal stop) {
  Renumbering result;
  std::size_t vertices = 0, faces = 0;
  for (const Slice& slice : slices) {
    vertices += slice.range.vertex_count();
    faces += slice.range.face_count();
  }
  result.given_vertex_.reserve(vertices);
  result.new_vertex_.reserve(vertices);
  result.given_face_.reserve(faces);
  lengthen(result.new_face_, faces, kNoFace, stop);
  for (const Slice& slice : slices) {
    const auto* const numbering = slice.numbering;
    const auto& range = slice.range;
    const auto& rank = slice.face_rank;
    const std::uint32_t vertex =
        static_cast<std::uint32_t>(result.given_vertex_.size()) - range.features.first_vertex;
    const std::uint32_t face = static_cast<std::uint32_t>(result.given_face_.size()) - range.first_face;
    in_pieces(range.features.first_vertex, range.features.end_vertex, stop,
              [&](std::size_t first, std::size_t end) {
                const std::size_t at = result.given_vertex_.size();
                result.given_vertex_.resize(at + end - first);
                result.new_vertex_.resize(at + end - first);
                for (std::size_t i = 0; i < end - first; ++i) {
                  result.given_vertex_[at + i] = numbering->given_vertex_[first + i] + vertex;
                  result.new_vertex_[at + i] = numbering->new_vertex_[first + i] + vertex;
                }
              });
    in_pieces(range.first_face, range.end_face, stop, [&](std::size_t first, std::size_t end) {
      const std::size_t at = result.given_face_.size();
      result.given_face_.resize(at + end - first);
      for (std::size_t i = 0; i < end - first; ++i) {
        const std::uint32_t old = number_of(numbering->given_face_[first + i]);
        const std::uint32_t given = (rank.empty() ? old : rank[old]) + face;
        result.new_face_[given] = NewFace{static_cast<std::uint32_t>(at + i)};
        result.given_face_[at + i] = GivenFace{given};
      }
    });
  }
  return result;
}

void Renumbering::extend(const Scene& scene, std::span<const Primitive> order, StopSignal stop) {
  new_vertex_.resize(scene.vertex_count(), kNoVertex);
  new_face_.resize(scene.face_count(), kNoFace);
  given_vertex_.reserve(scene.vertex_count());
  given_face_.reserve(scene.face_count());
  const auto meet = [this](std::uint32_t vertex) {
    if (new_vertex_[vertex] != kNoVertex) return;
    new_vertex_[vertex] = NewVertex{static_cast<std::uint32_t>(given_vertex_.size())};
    given_vertex_.push_back(GivenVertex{vertex});
  };
  const bool all_met = given_vertex_.size() == scene.vertex_count();
  PacedStop paced(stop);
  for (const Primitive primitive : order) {
    paced.check();
    if (!is_face(primitive)) {
      if (all_met) continue;
      for (const std::uint32_t vertex : primitive_vertices(scene, primitive)) meet(vertex);
      continue;
    }
    const std::uint32_t face = face_number(primitive);
    new_face_[face] = NewFace{static_cast<std::uint32_t>(given_face_.size())};
    given_face_.push_back(GivenFace{face});
    if (all_met) continue;
    for (const std::uint32_t vertex : scene.faces()[face]) meet(vertex);
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
  const auto renamed = [this](std::uint32_t vertex) { return number_of(new_vertex_[vertex]); };
  for_each_index(first_face, given_face_.size(), stop, [&](std::size_t f) {
    const Face& face = from.faces[number_of(given_face_[f])];
    to.faces[f] = {renamed(face[0]), renamed(face[1]), renamed(face[2])};
    to.face_edges[f] = from.face_edges[number_of(given_face_[f])];
  });
  to.edges.resize(scene.edge_count());
  for_each_index(first_edge, to.edges.size(), stop, [&](std::size_t e) {
    to.edges[e] = {renamed(from.edges[e][0]), renamed(from.edges[e][1])};
  });
  append_rows(from.vertex_faces, given_vertex_, new_face_, stop, to.vertex_faces);
  append_same_rows(from.edge_faces, new_face_, stop, to.edge_faces);
  append(to.lone_edges, std::span(from.lone_edges).subspan(to.lone_edges.size()), stop);
  to.vertex_lone_edges = lone_edges_of_vertices(to.edges, to.lone_edges, to.vertex_count, stop);
  to.body_of_vertex.reserve(scene.vertex_count());
  PacedStop paced(stop);
  for (std::size_t v = first_vertex; v < given_vertex_.size(); ++v) {
    paced.check();
    to.body_of_vertex.push_back(from.body_of_vertex[number_of(given_vertex_[v])]);
    if (scene.is_isolated(number_of(given_vertex_[v])))
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
  shorten(given_vertex_, extent.vertices);
  shorten(new_vertex_, extent.vertices);
  shorten(given_face_, extent.faces);
  shorten(new_face_, extent.faces);
  mesh.vertex_count = extent.vertices;
  mesh.body_count = extent.bodies;
  shorten(mesh.faces, extent.faces);
  shorten(mesh.face_edges, extent.faces);
  shorten(mesh.edges, extent.edges);
  shorten_rows(mesh.vertex_faces, extent.vertices);
  shorten_rows(mesh.edge_faces, extent.edges);
  shorten(mesh.body_of_vertex, extent.vertices);
  std::erase_if(mesh.lone_edges, [&](std::uint32_t e) { return e >= extent.edges; });
  if (mesh.lone_edges.empty())
    mesh.vertex_lone_edges = {};
  else
    shorten_rows(mesh.vertex_lone_edges, extent.vertices);
  std::erase_if(mesh.isolated_vertices, [&](std::uint32_t v) { return v >= extent.vertices; });
}

Patches Renumbering::apply(const Patches& patches) const {
  Patches result;
  if (patches.of_face.empty()) return result;
  result.of_face.reserve(given_face_.size());
  for (const GivenFace f : given_face_) result.of_face.push_back(patches.of_face[number_of(f)]);
  result.faces = renamed_items(patches.faces, new_face_);
  result.contours = renamed_items(patches.contours, new_vertex_);
  return result;
}

}  // namespace warmfront

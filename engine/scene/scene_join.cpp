// SPDX-License-Identifier: Apache-2.0
#include "engine/scene/scene_join.h"

#include <algorithm>
#include <utility>

#include "engine/parallel/stoppable_loops.h"
#include "engine/scene/connectivity.h"

namespace warmfront {
namespace {

// Appends items [first, end) of a list, with `shift` added to every number in them. Each piece is made longer
// and then written, so that the loop is one of lanes.
template <class T>
void append_shifted(std::vector<T>& to, const std::vector<T>& from, std::size_t first, std::size_t end,
                    std::uint32_t shift, StopSignal stop) {
  in_pieces(first, end, stop, [&](std::size_t begin, std::size_t piece_end) {
    if (shift == 0) {
      to.insert(to.end(), from.begin() + static_cast<std::ptrdiff_t>(begin),
                from.begin() + static_cast<std::ptrdiff_t>(piece_end));
      return;
    }
    const std::size_t at = to.size();
    to.resize(at + piece_end - begin);
    const T* read = from.data() + begin;
    T* write = to.data() + at;
    for (std::size_t i = 0; i < piece_end - begin; ++i) {
      if constexpr (requires { read[i][0]; }) {
        for (std::size_t k = 0; k < read[i].size(); ++k) write[i][k] = read[i][k] + shift;
      } else {
        write[i] = read[i] + shift;
      }
    }
  });
}

// Appends rows [first, end), their items shifted.
void append_rows(Csr& to, const Csr& from, std::size_t first, std::size_t end, std::uint32_t shift,
                 StopSignal stop) {
  if (first == end) return;
  const auto offset = static_cast<std::uint32_t>(to.items.size()) - from.begin[first];
  append_shifted(to.items, from.items, from.begin[first], from.begin[end], shift, stop);
  append_shifted(to.begin, from.begin, first + 1, end + 1, offset, stop);
}

// Appends those of an ascending list that are in [first, end).
void append_within(std::vector<std::uint32_t>& to, const std::vector<std::uint32_t>& from,
                   std::uint32_t first, std::uint32_t end, std::uint32_t shift, StopSignal stop) {
  const auto begin = std::ranges::lower_bound(from, first) - from.begin();
  const auto behind = std::ranges::lower_bound(from, end) - from.begin();
  append_shifted(to, from, static_cast<std::size_t>(begin), static_cast<std::size_t>(behind), shift, stop);
}

// Are these all vertices, faces and edges of a scene?
bool is_all(const MeshRange& range, const Scene& scene) {
  return range.vertex_count() == scene.vertex_count() && range.face_count() == scene.face_count() &&
         range.edge_count() == scene.edge_count();
}

}  // namespace

MeshRange mesh_range(const Scene& scene, std::uint32_t first_vertex, std::uint32_t end_vertex) {
  const auto faces_before = [&](std::uint32_t vertex) {
    return static_cast<std::uint32_t>(
        std::ranges::partition_point(scene.faces(), [&](const Face& f) { return f[0] < vertex; }) -
        scene.faces().begin());
  };
  return {features_of(scene, first_vertex, end_vertex), faces_before(first_vertex), faces_before(end_vertex)};
}

NumberShift shift_between(const MeshRange& from, const MeshRange& to) {
  return {to.features.first_vertex - from.features.first_vertex, to.first_face - from.first_face,
          to.features.first_edge - from.features.first_edge};
}

Scene SceneJoin::join(std::span<const SceneSlice> slices, std::uint32_t body_count, StopSignal stop) {
  Scene result;
  if (slices.size() == 1 && is_all(slices[0].range, *slices[0].scene) && slices[0].body_shift == 0 &&
      slices[0].scene->mesh_->body_count == body_count) {
    result.mesh_ = slices[0].scene->mesh_;
    return result;
  }
  const SceneSlice& front = slices.front();
  const bool takes_over = front.spare != nullptr && is_all(front.range, *front.scene) &&
                          front.body_shift == 0 && front.spare->mesh_.use_count() == 1;
  std::size_t vertices = 0, faces = 0, edges = 0, around = 0, along = 0;
  for (const SceneSlice& slice : slices) {
    const Scene::Mesh& from = *slice.scene->mesh_;
    const auto& [features, first_face, end_face] = slice.range;
    vertices += slice.range.vertex_count();
    faces += slice.range.face_count();
    edges += slice.range.edge_count();
    if (!from.vertex_faces.begin.empty())
      around += from.vertex_faces.begin[features.end_vertex] - from.vertex_faces.begin[features.first_vertex];
    if (!from.edge_faces.begin.empty())
      along += from.edge_faces.begin[number_of(features.end_edge)] -
               from.edge_faces.begin[number_of(features.first_edge)];
  }
  if (takes_over) std::swap(result.mesh_, front.spare->mesh_);
  Scene::Mesh& to = result.own_mesh();
  to.body_count = body_count;
  reserve(to.faces, faces, stop);
  reserve(to.face_edges, faces, stop);
  reserve(to.edges, edges, stop);
  const auto make_rows = [stop](Csr& csr, std::size_t rows, std::size_t items) {
    reserve(csr.begin, rows + 1, stop);
    reserve(csr.items, items, stop);
    if (csr.begin.empty()) csr.begin.push_back(0);
  };
  make_rows(to.vertex_faces, vertices, around);
  make_rows(to.edge_faces, edges, along);
  reserve(to.body_of_vertex, vertices, stop);
  for (const SceneSlice& slice : slices.subspan(takes_over ? 1 : 0)) {
    const Scene::Mesh& from = *slice.scene->mesh_;
    const auto& [features, first_face, end_face] = slice.range;
    const std::uint32_t vertex = to.vertex_count - features.first_vertex;
    const std::uint32_t face = static_cast<std::uint32_t>(to.faces.size()) - first_face;
    const std::uint32_t first_edge = number_of(features.first_edge);
    const std::uint32_t end_edge = number_of(features.end_edge);
    const std::uint32_t edge = static_cast<std::uint32_t>(to.edges.size()) - first_edge;
    if (!from.thickness.empty()) {
      lengthen(to.thickness, to.vertex_count, 0.0, stop);
      append(to.thickness,
             std::span(from.thickness).subspan(features.first_vertex, slice.range.vertex_count()), stop);
    }
    append_shifted(to.faces, from.faces, first_face, end_face, vertex, stop);
    append_shifted(to.face_edges, from.face_edges, first_face, end_face, edge, stop);
    append_shifted(to.edges, from.edges, first_edge, end_edge, vertex, stop);
    append_rows(to.vertex_faces, from.vertex_faces, features.first_vertex, features.end_vertex, face, stop);
    append_rows(to.edge_faces, from.edge_faces, first_edge, end_edge, face, stop);
    append_within(to.lone_edges, from.lone_edges, first_edge, end_edge, edge, stop);
    append_within(to.isolated_vertices, from.isolated_vertices, features.first_vertex, features.end_vertex,
                  vertex, stop);
    append_shifted(to.body_of_vertex, from.body_of_vertex, features.first_vertex, features.end_vertex,
                   slice.body_shift, stop);
    to.vertex_count += slice.range.vertex_count();
  }
  to.vertex_lone_edges = lone_edges_of_vertices(to.edges, to.lone_edges, to.vertex_count, stop);
  in_pieces(0, to.thickness.size(), stop, [&](std::size_t first, std::size_t end) {
    for (std::size_t v = first; v < end; ++v)
      to.most_thickness = std::max(to.most_thickness, to.thickness[v]);
  });
  if (to.most_thickness == 0)
    to.thickness = {};
  else
    lengthen(to.thickness, to.vertex_count, 0.0, stop);
  return result;
}

std::vector<std::uint32_t> SceneJoin::order_faces_by_body(Scene& scene, StopSignal stop) {
  const auto body_of = [&](const Face& face) { return scene.body_of_vertex()[face[0]]; };
  std::vector<std::uint32_t> rank;
  bool ordered = true;
  in_pieces(1, scene.face_count(), stop, [&](std::size_t first, std::size_t end) {
    for (std::size_t f = first; f < end; ++f)
      ordered &= body_of(scene.faces()[f - 1]) <= body_of(scene.faces()[f]);
  });
  if (ordered) return rank;
  std::vector<std::uint32_t> next(std::size_t{scene.body_count()} + 1, 0);
  PacedStop paced(stop);
  for (const Face& face : scene.faces()) {
    paced.check();
    ++next[body_of(face) + 1];
  }
  for (std::size_t b = 1; b < next.size(); ++b) next[b] += next[b - 1];
  reserve(rank, scene.face_count(), stop);
  for (const Face& face : scene.faces()) {
    paced.check();
    rank.push_back(next[body_of(face)]++);
  }
  Scene::Mesh& mesh = scene.own_mesh();
  const auto reorder = [&](auto& list) {
    auto ordered = list;
    for (std::size_t f = 0; f < rank.size(); ++f) {
      paced.check();
      ordered[rank[f]] = list[f];
    }
    list = std::move(ordered);
  };
  reorder(mesh.faces);
  reorder(mesh.face_edges);
  // Lists are of faces of one body each, whose order stays: so do theirs.
  for (Csr* csr : {&mesh.vertex_faces, &mesh.edge_faces}) {
    for (std::uint32_t& face : csr->items) {
      paced.check();
      face = rank[face];
    }
  }
  return rank;
}

}  // namespace warmfront

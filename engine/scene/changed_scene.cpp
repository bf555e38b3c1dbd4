// SPDX-License-Identifier: Apache-2.0
#include "engine/scene/changed_scene.h"

#include <algorithm>
#include <array>
#include <functional>
#include <utility>
#include <vector>

#include "engine/parallel/stoppable_loops.h"
#include "engine/scene/connectivity.h"
#include "engine/scene/follow_runs.h"

namespace warmfront {
namespace {

constexpr std::uint32_t kNone = LocalChange::kNone;
constexpr EdgeId kNoEdge = LocalChange::kNoEdge;
using Three = std::array<std::uint32_t, 3>;

// What stays of a row, then what came to it: both ascend.
void append_row(ChangedRows& rows, std::span<const std::uint32_t> before,
                std::span<const std::uint32_t> face_of, std::uint32_t first_face, std::uint32_t row,
                std::span<const Edge> came, std::size_t& next) {
  const auto first = static_cast<std::ptrdiff_t>(rows.items.size());
  for (const std::uint32_t f : before) {
    if (face_of[f - first_face] != kNone) rows.items.push_back(face_of[f - first_face]);
  }
  const auto middle = static_cast<std::ptrdiff_t>(rows.items.size());
  while (next < came.size() && came[next][0] < row) ++next;
  for (; next < came.size() && came[next][0] == row; ++next) rows.items.push_back(came[next][1]);
  std::inplace_merge(rows.items.begin() + first, rows.items.begin() + middle, rows.items.end());
  rows.end_row(row);
}

// The edges of each face, in the numbers that these have now; `came` says those of a face that is in no run.
template <class Came>
void follow_edges(std::vector<Three>& to, std::span<const Three> from, const MeshRange& part,
                  const LocalChange& change, std::size_t count, StopSignal stop, Came&& came) {
  const std::uint32_t first_edge = number_of(part.features.first_edge);
  const std::span<const Three> before = from.subspan(part.first_face, part.face_count());
  if (in_place(change.edge_runs))
    append_runs_less(to, before, change.face_runs, count, stop, came, first_edge);
  else
    append_runs(to, before, change.face_runs, count, stop, came,
                [&](std::uint32_t edge) { return number_of(change.edge_of[edge - first_edge]); });
}

// (what a face that came has, the face), ascending and each once.
template <class Has>
std::vector<Edge> by_what_they_have(std::span<const std::uint32_t> came, StopSignal stop, Has&& has) {
  std::vector<Edge> rows;
  rows.reserve(3 * came.size());
  PacedStop paced(stop, 256);
  for (const std::uint32_t f : came) {
    paced.check();
    for (const std::uint32_t row : has(f)) rows.push_back({row, f});
  }
  sort_stoppably(rows, stop, std::less<>());
  rows.erase(std::unique(rows.begin(), rows.end()), rows.end());
  return rows;
}

}  // namespace

Scene ChangedScene::as_given(const Scene& before, const MeshRange& part, SceneDescription description,
                             const LocalChange& change, StopSignal stop) {
  Scene scene;
  Scene::Mesh& mesh = scene.own_mesh();
  const Scene::Mesh& old = *before.mesh_;
  const std::uint32_t first_vertex = part.features.first_vertex;
  const std::uint32_t first_edge = number_of(part.features.first_edge);
  mesh.vertex_count = description.vertex_count;
  mesh.body_count = 1;
  const std::size_t faces = description.faces.size();
  reserve(mesh.faces, faces, stop);
  in_pieces(0, faces, stop, [&](std::size_t first, std::size_t end) {
    mesh.faces.resize(end);
    for (std::size_t f = first; f < end; ++f) {
      for (std::size_t k = 0; k < 3; ++k)
        mesh.faces[f][k] = static_cast<std::uint32_t>(description.faces[f][k]);
    }
  });
  std::vector<std::uint32_t> edges_that_came;
  std::vector<std::uint32_t> changed_edges;
  PacedStop paced(stop, 256);
  for (const LocalChange::Touched& edge : change.touched) {
    paced.check();
    if (edge.now == kNoEdge) continue;
    if (edge.is_lone) mesh.lone_edges.push_back(number_of(edge.now));
    if (edge.changed()) changed_edges.push_back(number_of(edge.now));
  }
  const auto touched = [&](const Edge& ends) -> const LocalChange::Touched& {
    return *std::ranges::lower_bound(change.touched, ends, {}, &LocalChange::Touched::ends);
  };
  auto next_touched = change.touched.begin();
  const auto edge_that_came = [&](std::size_t e) {
    while (number_of(next_touched->now) != e) ++next_touched;
    return next_touched->ends;
  };
  append_runs_less(mesh.edges, std::span<const Edge>(old.edges).subspan(first_edge, part.edge_count()),
                   change.edge_runs, change.edge_before.size(), stop, edge_that_came, first_vertex);

  const auto side = [&](const Face& face, std::size_t k) {
    const auto [lesser, greater] = std::minmax({face[k], face[(k + 1) % 3]});
    return number_of(touched({lesser, greater}).now);
  };
  follow_edges(mesh.face_edges, old.face_edges, part, change, faces, stop, [&](std::size_t f) {
    const Face face = mesh.faces[f];
    return Three{side(face, 0), side(face, 1), side(face, 2)};
  });

  const ItemNumbers face_numbers{change.face_of, part.first_face, in_place(change.face_runs)};
  ChangedRows around;
  std::vector<Edge> came =
      by_what_they_have(change.came, stop, [&](std::uint32_t f) { return mesh.faces[f]; });
  std::size_t next = 0;
  for (const std::uint32_t v : change.at) {
    paced.check();
    append_row(around, old.vertex_faces[first_vertex + v], change.face_of, part.first_face, v, came, next);
  }
  const std::vector<Run> all_vertices{{0, mesh.vertex_count, 0}};
  follow_rows(mesh.vertex_faces, old.vertex_faces, first_vertex, without(all_vertices, change.at), around,
              face_numbers, mesh.vertex_count, stop);

  ChangedRows along;
  came = by_what_they_have(change.came, stop, [&](std::uint32_t f) { return mesh.face_edges[f]; });
  next = 0;
  for (const LocalChange::Touched& edge : change.touched) {
    paced.check();
    if (edge.now == kNoEdge || !edge.changed()) continue;
    std::span<const std::uint32_t> row;
    if (edge.before != kNoEdge) row = old.edge_faces[first_edge + number_of(edge.before)];
    append_row(along, row, change.face_of, part.first_face, number_of(edge.now), came, next);
  }
  follow_rows(mesh.edge_faces, old.edge_faces, first_edge, without(change.edge_runs, changed_edges), along,
              face_numbers, mesh.edges.size(), stop);

  mesh.vertex_lone_edges = lone_edges_of_vertices(mesh.edges, mesh.lone_edges, mesh.vertex_count, stop);
  auto at = change.at.begin();
  const auto take_changed = [&](std::uint32_t until) {
    for (; at != change.at.end() && *at < until; ++at) {
      if (scene.is_isolated(*at)) mesh.isolated_vertices.push_back(*at);
    }
  };
  const auto& isolated = old.isolated_vertices;
  for (auto v = std::ranges::lower_bound(isolated, first_vertex);
       v != isolated.end() && *v < part.features.end_vertex; ++v) {
    paced.check();
    const std::uint32_t vertex = *v - first_vertex;
    take_changed(vertex);
    if (at == change.at.end() || *at != vertex) mesh.isolated_vertices.push_back(vertex);
  }
  take_changed(mesh.vertex_count);

  for (const double thickness : description.thickness)
    mesh.most_thickness = std::max(mesh.most_thickness, thickness);
  if (mesh.most_thickness > 0) mesh.thickness = std::move(description.thickness);
  lengthen(mesh.body_of_vertex, mesh.vertex_count, 0U, stop);
  scene.bodies_ = std::move(description.bodies);
  scene.name_bytes_ = scene.bodies_[0].name.size();
  return scene;
}

Scene ChangedScene::renumbered(const Scene& before, const MeshRange& part, const Scene& given,
                               const Renumbering& numbering, const LocalChange& change, StopSignal stop) {
  Scene scene;
  Scene::Mesh& to = scene.own_mesh();
  const Scene::Mesh& old = *before.mesh_;
  const Scene::Mesh& from = *given.mesh_;
  const std::uint32_t first_vertex = part.features.first_vertex;
  const std::uint32_t first_edge = number_of(part.features.first_edge);
  to.vertex_count = from.vertex_count;
  to.body_count = from.body_count;
  const ItemNumbers face_numbers{change.face_of, part.first_face, in_place(change.face_runs)};
  // Of what will follow it, in the scene that this is the first part of.
  const bool first = first_vertex == 0;
  const auto room = [&](auto& list, std::size_t count, std::size_t all, std::size_t own) {
    if (first) reserve(list, count + (all - own), stop);
  };
  const auto room_of_rows = [&](Csr& rows, std::size_t count, const Csr& all, std::size_t end) {
    room(rows.begin, count + 1, all.rows(), end);
    room(rows.items, from.faces.size() * 3, all.items.size(), all.begin[end]);
  };
  const auto renamed = [&](std::uint32_t v) { return number_of(numbering.renumbered(GivenVertex{v})); };
  const auto given_face = [&](std::size_t f) {
    return number_of(numbering.given(NewFace{static_cast<std::uint32_t>(f)}));
  };
  const auto list_faces = [&] {
    const auto came = [&](std::size_t f) {
      const Face& face = from.faces[given_face(f)];
      return Face{renamed(face[0]), renamed(face[1]), renamed(face[2])};
    };
    room(to.faces, from.faces.size(), old.faces.size(), part.face_count());
    room(to.face_edges, from.faces.size(), old.faces.size(), part.face_count());
    append_runs_less(to.faces, std::span<const Face>(old.faces).subspan(part.first_face, part.face_count()),
                     change.face_runs, from.faces.size(), stop, came, first_vertex);
    follow_edges(to.face_edges, old.face_edges, part, change, from.faces.size(), stop,
                 [&](std::size_t f) { return from.face_edges[given_face(f)]; });
  };
  const auto list_edges = [&] {
    const auto came = [&](std::size_t e) {
      return Edge{renamed(from.edges[e][0]), renamed(from.edges[e][1])};
    };
    room(to.edges, from.edges.size(), old.edges.size(), part.edge_count());
    append_runs_less(to.edges, std::span<const Edge>(old.edges).subspan(first_edge, part.edge_count()),
                     change.edge_runs, from.edges.size(), stop, came, first_vertex);
    append(to.lone_edges, std::span<const std::uint32_t>(from.lone_edges), stop);
    to.vertex_lone_edges = lone_edges_of_vertices(to.edges, to.lone_edges, to.vertex_count, stop);
  };
  const auto list_around = [&] {
    ChangedRows around;
    for (const std::uint32_t v : change.at) {
      for (const std::uint32_t f : from.vertex_faces[number_of(numbering.given(NewVertex{v}))])
        around.items.push_back(number_of(numbering.renumbered(GivenFace{f})));
      around.end_row(v);
    }
    const std::vector<Run> all_vertices{{0, to.vertex_count, 0}};
    room_of_rows(to.vertex_faces, to.vertex_count, old.vertex_faces, part.vertex_count());
    follow_rows(to.vertex_faces, old.vertex_faces, first_vertex, without(all_vertices, change.at), around,
                face_numbers, to.vertex_count, stop);
  };
  const auto list_along = [&] {
    ChangedRows along;
    PacedStop paced(stop, 256);
    for (const LocalChange::Touched& edge : change.touched) {
      paced.check();
      if (edge.now == kNoEdge || !edge.changed()) continue;
      for (const std::uint32_t f : from.edge_faces[number_of(edge.now)])
        along.items.push_back(number_of(numbering.renumbered(GivenFace{f})));
      along.end_row(number_of(edge.now));
    }
    room_of_rows(to.edge_faces, from.edges.size(), old.edge_faces, part.edge_count());
    follow_rows(to.edge_faces, old.edge_faces, first_edge, without(change.edge_runs, along.rows), along,
                face_numbers, from.edges.size(), stop);
  };
  const auto list_vertices = [&] {
    room(to.body_of_vertex, to.vertex_count, old.vertex_count, part.vertex_count());
    lengthen(to.body_of_vertex, to.vertex_count, 0U, stop);
    reserve(to.isolated_vertices, from.isolated_vertices.size(), stop);
    for (const std::uint32_t v : from.isolated_vertices) to.isolated_vertices.push_back(renamed(v));
    std::ranges::sort(to.isolated_vertices);
  };
  fork_all(ForkPlace::here(), list_faces, list_edges, list_around, list_along, list_vertices);
  return scene;
}

}  // namespace warmfront

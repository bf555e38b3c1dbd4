// SPDX-License-Identifier: Apache-2.0
// A scene with bodies added and changed.
#include <algorithm>
#include <array>
#include <optional>
#include <span>
#include <utility>

#include "engine/parallel/stoppable_loops.h"
#include "engine/scene.h"
#include "engine/scene/connectivity.h"
#include "engine/scene/description_checks.h"

namespace warmfront {
namespace {

// Appends the same list of several meshes, with `shift` added to every number in it.
template <class T, class List, class Shift>
void join(std::vector<T>& to, const auto& meshes, StopSignal stop, List&& list, Shift&& shift) {
  std::size_t size = 0;
  for (const auto& mesh : meshes) size += list(*mesh).size();
  to.reserve(size);
  for (std::size_t m = 0; m < meshes.size(); ++m) {
    const std::vector<T>& from = list(*meshes[m]);
    const std::uint32_t more = shift(m);
    in_pieces(0, from.size(), stop, [&](std::size_t first, std::size_t end) {
      for (std::size_t i = first; i < end; ++i) {
        T item = from[i];
        if constexpr (requires { item[0]; }) {
          for (std::uint32_t& number : item) number += more;
        } else {
          item += more;
        }
        to.push_back(item);
      }
    });
  }
}

// Are these a rest shape of a body that is added?
Status check_rest_shape(const Body& body, std::span<const double> positions, const std::string& where,
                        StopSignal stop) {
  if (positions.empty())
    return Error{ErrorCode::kFailedPrecondition,
                 where + ": the scene's filters have near_at_rest; give the body's positions with it"};
  const PairFilters of_body{.near_at_rest = 1, .rest_positions = {positions.begin(), positions.end()}};
  const Status status = check_filters(of_body, body.vertex_count, stop);
  if (status) return {};
  return Error{status.error().code, where + ": " + status.error().message};
}

}  // namespace

std::shared_ptr<Scene::Mesh> Scene::joined(std::span<const std::shared_ptr<Mesh>> meshes, StopSignal stop) {
  auto result = std::make_shared<Mesh>();
  Mesh& to = *result;
  struct First {
    std::uint32_t vertex, face, edge, body, vertex_item, edge_item;
  };
  std::vector<First> first;
  first.reserve(meshes.size());
  First next{};
  const auto size = [](const auto& list) { return static_cast<std::uint32_t>(list.size()); };
  for (const auto& mesh : meshes) {
    first.push_back(next);
    next = {next.vertex + mesh->vertex_count,
            next.face + size(mesh->faces),
            next.edge + size(mesh->edges),
            next.body + mesh->body_count,
            next.vertex_item + size(mesh->vertex_faces.items),
            next.edge_item + size(mesh->edge_faces.items)};
  }
  to.vertex_count = next.vertex;
  to.body_count = next.body;
  const auto by_vertex = [&](std::size_t m) { return first[m].vertex; };
  const auto by_face = [&](std::size_t m) { return first[m].face; };
  const auto by_edge = [&](std::size_t m) { return first[m].edge; };
  join(
      to.faces, meshes, stop, [](const Mesh& m) -> auto& { return m.faces; }, by_vertex);
  join(
      to.edges, meshes, stop, [](const Mesh& m) -> auto& { return m.edges; }, by_vertex);
  join(
      to.face_edges, meshes, stop, [](const Mesh& m) -> auto& { return m.face_edges; }, by_edge);
  // Offsets continue from the previous mesh: all but each list's leading 0 is appended.
  const auto join_rows = [&](Csr& rows, auto&& of, auto&& first_item) {
    join(
        rows.items, meshes, stop, [&](const Mesh& m) -> auto& { return of(m).items; }, by_face);
    std::size_t count = 1;
    for (const auto& mesh : meshes) count += of(*mesh).rows();
    rows.begin.reserve(count);
    rows.begin.push_back(0);
    for (std::size_t m = 0; m < meshes.size(); ++m) {
      const std::vector<std::uint32_t>& from = of(*meshes[m]).begin;
      in_pieces(1, from.size(), stop, [&](std::size_t begin, std::size_t end) {
        for (std::size_t row = begin; row < end; ++row) rows.begin.push_back(first_item(m) + from[row]);
      });
    }
  };
  join_rows(
      to.vertex_faces, [](const Mesh& m) -> const Csr& { return m.vertex_faces; },
      [&](std::size_t m) { return first[m].vertex_item; });
  join_rows(
      to.edge_faces, [](const Mesh& m) -> const Csr& { return m.edge_faces; },
      [&](std::size_t m) { return first[m].edge_item; });
  join(
      to.lone_edges, meshes, stop, [](const Mesh& m) -> auto& { return m.lone_edges; }, by_edge);
  to.vertex_lone_edges = lone_edges_of_vertices(to.edges, to.lone_edges, to.vertex_count, stop);
  join(
      to.isolated_vertices, meshes, stop, [](const Mesh& m) -> auto& { return m.isolated_vertices; },
      by_vertex);
  join(
      to.body_of_vertex, meshes, stop, [](const Mesh& m) -> auto& { return m.body_of_vertex; },
      [&](std::size_t m) { return first[m].body; });
  for (std::size_t m = 0; m < meshes.size(); ++m) {
    if (meshes[m]->thickness.empty()) continue;
    lengthen(to.thickness, first[m].vertex, 0.0, stop);
    append(to.thickness, std::span<const double>(meshes[m]->thickness), stop);
    to.most_thickness = std::max(to.most_thickness, meshes[m]->most_thickness);
  }
  if (!to.thickness.empty()) lengthen(to.thickness, to.vertex_count, 0.0, stop);
  return result;
}

Result<Scene> Scene::with_body(BodyAddition addition) const {
  std::array<SceneChange, 1> changes{AddBody{std::move(addition), {}}};
  std::size_t failed = 0;
  return with_changes(changes, failed);
}

Result<Scene> Scene::with_body_changed(std::uint32_t index, Body body) const {
  Scene scene = *this;
  if (Status status = scene.change(index, std::move(body)); !status) return status.error();
  return scene;
}

Result<Scene> Scene::with_changes(std::span<SceneChange> changes, std::size_t& failed,
                                  StopSignal stop) const {
  Scene scene = *this;
  const auto additions = static_cast<std::size_t>(std::ranges::count_if(
      changes, [](const SceneChange& change) { return std::holds_alternative<AddBody>(change); }));
  if (additions > 0) scene.bodies_.reserve(bodies_.size() + additions);
  std::vector<std::shared_ptr<Mesh>> meshes{mesh_};
  meshes.reserve(1 + additions);
  std::uint64_t vertices = vertex_count();
  std::uint64_t faces = face_count();
  std::uint64_t lone_edges = this->lone_edges().size();
  std::optional<PairFilters> filters;  // where they change
  const auto changed_filters = [&]() -> PairFilters& {
    return filters ? *filters : filters.emplace(this->filters());
  };
  const auto add = [&](BodyAddition& addition, std::span<const double> positions) -> Status {
    const std::string where = name_of(scene.bodies_.size());
    if (bodies_.empty())
      return Error{ErrorCode::kFailedPrecondition,
                   "bodies: the scene declares none; declare its bodies to add one"};
    if (Status status = check_body(addition.body, where); !status) return status.error();
    // Checked as a scene of its own.
    SceneDescription description{addition.body.vertex_count, std::move(addition.faces), {addition.body}};
    description.edges = std::move(addition.edges);
    description.bodies.front().first_vertex = 0;
    Result<Scene> added = create(std::move(description), stop);
    if (!added) return Error{added.error().code, where + ": " + added.error().message};
    addition.body.first_vertex = static_cast<std::uint32_t>(vertices);
    vertices += added.value().vertex_count();
    faces += added.value().face_count();
    lone_edges += added.value().lone_edges().size();
    if (Status status = check_size(vertices, faces, lone_edges); !status)
      return Error{status.error().code, where + ": with it, " + status.error().message};
    const PairFilters& before = filters ? *filters : this->filters();
    if (before.near_at_rest > 0) {
      if (Status status = check_rest_shape(addition.body, positions, where, stop); !status)
        return status.error();
    }
    if (before.near_at_rest > 0 || !before.patches.empty())
      changed_filters().append_body(addition.body.vertex_count, positions);
    meshes.push_back(added.value().mesh_);
    scene.name_bytes_ += addition.body.name.size();
    scene.bodies_.push_back(std::move(addition.body));
    return {};
  };
  for (failed = 0; failed < changes.size(); ++failed) {
    stop.check();
    if (auto* added = std::get_if<AddBody>(&changes[failed])) {
      if (Status status = add(added->addition, added->positions); !status) return status.error();
      continue;
    }
    if (auto* other = std::get_if<ChangeFilters>(&changes[failed])) {
      if (Status status = check_filters(other->filters, static_cast<std::uint32_t>(vertices), stop); !status)
        return status.error();
      filters = std::move(other->filters);
      continue;
    }
    auto& [index, body] = std::get<ChangeBody>(changes[failed]);
    if (index < scene.bodies_.size() && scene.bodies_[index].kind == BodyKind::kRemoved)
      return invalid_argument("body " + std::to_string(index) + " was removed; add a new one");
    if (Status status = scene.change(index, std::move(body)); !status) return status.error();
  }
  if (Status status = check_half_spaces(scene.bodies_); !status) {
    failed = changes.empty() ? 0 : changes.size() - 1;
    return status.error();
  }
  if (additions > 0) scene.mesh_ = joined(meshes, stop);
  if (filters)
    scene.filters_ = filters->any() ? std::make_shared<const PairFilters>(*std::move(filters)) : nullptr;
  return scene;
}

Status Scene::change(std::uint32_t index, Body body) {
  if (index >= bodies_.size())
    return invalid_argument("body " + std::to_string(index) + " is not in [0, " +
                            std::to_string(bodies_.size()) + ")");
  body.first_vertex = bodies_[index].first_vertex;
  body.vertex_count = bodies_[index].vertex_count;
  const std::optional<HalfSpace>& half_space = bodies_[index].half_space;
  if (half_space && !body.half_space) {
    if (body.kind != BodyKind::kRemoved)
      return invalid_argument(name_of(index) +
                              ".half_space: is missing; the body is a half-space and stays one: give it");
    body.half_space = half_space;
  }
  if (Status status = check_body(body, name_of(index)); !status) return status.error();
  name_bytes_ += body.name.size() - bodies_[index].name.size();
  bodies_[index] = std::move(body);
  return {};
}

}  // namespace warmfront

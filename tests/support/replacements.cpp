// SPDX-License-Identifier: Apache-2.0
#include "tests/support/replacements.h"

#include <algorithm>
#include <optional>
#include <utility>
#include <vector>

#include "tests/support/scenes.h"

namespace warmfront::testing {
namespace {

// What a body is made of, in numbers of its own.
struct Alone {
  Body body;
  Faces faces;
  Edges edges;
  std::vector<double> positions, reference, thickness, at_rest;
  std::vector<std::uint32_t> patches;
};

template <class T>
std::vector<T> rows_of(const std::vector<T>& all, const Body& body, std::ptrdiff_t each) {
  if (all.empty()) return {};
  const auto first = all.begin() + each * body.first_vertex;
  return {first, first + each * body.vertex_count};
}

std::vector<Alone> take_apart(const AcceptedState& state) {
  std::vector<Alone> bodies;
  for (const Body& body : state.scene.bodies) {
    bodies.push_back({body,
                      {},
                      {},
                      rows_of(state.positions, body, 3),
                      rows_of(state.reference, body, 3),
                      rows_of(state.scene.thickness, body, 1),
                      rows_of(state.scene.filters.rest_positions, body, 3),
                      rows_of(state.scene.filters.patches, body, 1)});
  }
  const auto of = [&](std::int32_t vertex) -> Alone& {
    for (Alone& alone : bodies) {
      const auto first = static_cast<std::int32_t>(alone.body.first_vertex);
      if (vertex >= first && vertex < first + static_cast<std::int32_t>(alone.body.vertex_count))
        return alone;
    }
    std::abort();
  };
  const auto counted_from = [](auto element, const Alone& alone) {
    for (std::int32_t& v : element) v -= static_cast<std::int32_t>(alone.body.first_vertex);
    return element;
  };
  for (const auto& face : state.scene.faces) {
    Alone& alone = of(face[0]);
    alone.faces.push_back(counted_from(face, alone));
  }
  for (const auto& edge : state.scene.edges) {
    Alone& alone = of(edge[0]);
    alone.edges.push_back(counted_from(edge, alone));
  }
  return bodies;
}

void put_together(const std::vector<Alone>& bodies, AcceptedState& state) {
  SceneDescription& scene = state.scene;
  scene.vertex_count = 0;
  scene.faces.clear();
  scene.edges.clear();
  scene.bodies.clear();
  state.positions.clear();
  state.reference.clear();
  std::vector<double> thickness, at_rest;
  std::vector<std::uint32_t> patches;
  const auto append = [](auto& to, const auto& more) { to.insert(to.end(), more.begin(), more.end()); };
  for (const Alone& alone : bodies) {
    const auto first = static_cast<std::int32_t>(scene.vertex_count);
    for (const auto& [a, b, c] : alone.faces) scene.faces.push_back({a + first, b + first, c + first});
    for (const auto& [a, b] : alone.edges) scene.edges.push_back({a + first, b + first});
    scene.bodies.push_back(alone.body);
    scene.bodies.back().first_vertex = scene.vertex_count;
    scene.vertex_count += alone.body.vertex_count;
    append(state.positions, alone.positions);
    append(state.reference, alone.reference);
    append(thickness, alone.thickness);
    append(at_rest, alone.at_rest);
    append(patches, alone.patches);
  }
  if (!scene.thickness.empty()) scene.thickness = thickness;
  if (scene.filters.near_at_rest > 0) scene.filters.rest_positions = at_rest;
  if (!scene.filters.patches.empty()) scene.filters.patches = patches;
}

bool filters_name(const AcceptedState& state, const Body& body) {
  const auto within = [&](std::uint32_t v) {
    return v >= body.first_vertex && v < body.first_vertex + body.vertex_count;
  };
  return std::ranges::any_of(state.scene.filters.excluded_vertex_pairs,
                             [&](const auto& pair) { return within(pair[0]) || within(pair[1]); });
}

// Some of the elements, others turned over, and a few new ones.
ReplaceElements draw_elements(Draws& draws, std::uint32_t index, std::uint32_t vertices, Faces faces,
                              Edges edges) {
  const auto any = [&] { return static_cast<std::int32_t>(draws.below(static_cast<int>(vertices))); };
  if (!faces.empty() && draws.below(2) == 0) {  // one or two alone, so that the rest is kept
    for (int i = draws.below(2); i >= 0 && !faces.empty(); --i) {
      const auto f = static_cast<std::size_t>(draws.below(static_cast<int>(faces.size())));
      const int how = draws.below(4);
      if (how == 0)
        faces.erase(faces.begin() + static_cast<std::ptrdiff_t>(f));
      else if (how == 1)
        std::swap(faces[f][1], faces[f][2]);
      else if (how == 2)
        faces[f][static_cast<std::size_t>(draws.below(3))] = any();
      else
        faces.insert(faces.begin() + static_cast<std::ptrdiff_t>(f), {faces[f][0], any(), faces[f][2]});
    }
    return {index, std::move(faces), std::move(edges)};
  }
  std::erase_if(faces, [&](const auto&) { return draws.below(5) == 0; });
  std::erase_if(edges, [&](const auto&) { return draws.below(3) == 0; });
  for (auto& face : faces) {
    if (draws.below(5) == 0) std::swap(face[0], face[1]);
    if (draws.below(8) == 0) face[static_cast<std::size_t>(draws.below(3))] = any();
  }
  for (int i = draws.below(4); i > 0; --i) faces.push_back({any(), any(), any()});
  for (int i = draws.below(4); i > 0; --i) {
    const std::int32_t a = any(), b = any();
    if (a != b) edges.push_back({a, b});
  }
  return {index, std::move(faces), std::move(edges)};
}

// Half-spaces are not replaced, and replace nothing.
AddOperation draw_mesh(Draws& draws, const AcceptedState& state) {
  AddOperation mesh = draw_addition(draws, state);
  while (mesh.addition.body.half_space) mesh = draw_addition(draws, state);
  return mesh;
}

// Of this body.
SceneChange draw_change_of(Draws& draws, const AcceptedState& state, std::uint32_t index) {
  ChangeOperation change = draw_change(draws, state);
  while (change.body != index) change = draw_change(draws, state);
  change.as.vertex_count = state.scene.bodies[index].vertex_count;
  return ChangeBody{index, change.as};
}

SceneChange draw_body_replacement(Draws& draws, const AcceptedState& state, std::uint32_t index) {
  const Body& body = state.scene.bodies[index];
  if (draws.below(5) == 0 && body.vertex_count < state.scene.vertex_count) {
    ReplaceBody gone{index, {{}, {}}, {}};
    gone.addition.body.kind = BodyKind::kRemoved;
    return gone;
  }
  AddOperation other = draw_mesh(draws, state);
  ReplaceBody change{index, std::move(other.addition), std::move(other.positions)};
  // Once its vertices are thick, another change of the list would have to say how thick theirs are.
  change.addition.thickness.clear();
  if (!state.scene.thickness.empty()) {
    for (std::uint32_t v = 0; v < change.addition.body.vertex_count; ++v)
      change.addition.thickness.push_back(draws.below(2) * 0.02 * state.unit);
  }
  return change;
}

SceneChange draw_change_of_any_kind(Draws& draws, const AcceptedState& state) {
  if (state.scene.bodies.empty())
    return draw_elements(draws, 0, state.scene.vertex_count, state.scene.faces, state.scene.edges);
  const auto index = static_cast<std::uint32_t>(draws.below(static_cast<int>(state.scene.bodies.size())));
  const Body& body = state.scene.bodies[index];
  const bool removed = body.kind == BodyKind::kRemoved;
  const int kind = draws.below(10);
  if (kind == 0 && state.scene.bodies.size() < 8) {
    AddOperation add = draw_addition(draws, state);
    return AddBody{std::move(add.addition), std::move(add.positions)};
  }
  if (kind <= 2 && !removed) return draw_change_of(draws, state, index);
  if (body.half_space) return ChangeFilters{state.scene.filters};
  if ((kind <= 5 || filters_name(state, body)) && !removed) {
    const Alone alone = take_apart(state)[index];
    return draw_elements(draws, index, body.vertex_count, alone.faces, alone.edges);
  }
  if (filters_name(state, body)) return ChangeFilters{};
  return draw_body_replacement(draws, state, index);
}

}  // namespace

void accept_replacement(AcceptedState& state, const ReplaceElements& change) {
  if (state.scene.bodies.empty()) {
    state.scene.faces = change.faces;
    state.scene.edges = change.edges;
    return;
  }
  std::vector<Alone> bodies = take_apart(state);
  bodies[change.index].faces = change.faces;
  bodies[change.index].edges = change.edges;
  put_together(bodies, state);
}

void accept_replacement(AcceptedState& state, const ReplaceBody& change) {
  std::vector<Alone> bodies = take_apart(state);
  Alone& alone = bodies[change.index];
  const std::uint32_t end = alone.body.first_vertex + alone.body.vertex_count;
  for (auto& pair : state.scene.filters.excluded_vertex_pairs) {
    for (std::uint32_t& v : pair) {
      if (v >= end) v += change.addition.body.vertex_count - alone.body.vertex_count;
    }
  }
  const std::uint32_t count = change.addition.body.vertex_count;
  alone = {change.addition.body,  change.addition.faces,
           change.addition.edges, change.positions,
           change.positions,      change.addition.thickness,
           change.positions,      std::vector<std::uint32_t>(count, 0)};
  alone.thickness.resize(count);
  put_together(bodies, state);
  state.pose[change.index].reset();
}

ChangesOperation draw_replacements(Draws& draws, const AcceptedState& state) {
  ChangesOperation operation;
  AcceptedState after = state;
  for (int i = 1 + draws.below(3); i > 0; --i) {
    operation.changes.push_back(draw_change_of_any_kind(draws, after));
    after.accept(ChangesOperation{{operation.changes.back()}});
  }
  return operation;
}

std::optional<SceneChange> draw_replacement(Draws& draws, const AcceptedState& state) {
  SceneChange change = draw_change_of_any_kind(draws, state);
  const bool replaces =
      std::holds_alternative<ReplaceElements>(change) || std::holds_alternative<ReplaceBody>(change);
  return replaces ? std::optional(std::move(change)) : std::nullopt;
}

ChangesOperation draw_wrong_replacements(Draws& draws, const AcceptedState& state) {
  ChangesOperation operation = draw_replacements(draws, state);
  AcceptedState after = state;
  after.accept(operation);
  const auto bodies = static_cast<std::uint32_t>(after.scene.bodies.size());
  const std::uint32_t beyond = std::max(1U, bodies) + static_cast<std::uint32_t>(draws.below(3));
  const auto index = static_cast<std::uint32_t>(bodies == 0 ? 0 : draws.below(static_cast<int>(bodies)));
  const std::uint32_t vertices =
      bodies == 0 ? after.scene.vertex_count : after.scene.bodies[index].vertex_count;
  if (bodies == 0 || draws.below(3) == 0) {
    if (draws.below(2) == 0)
      operation.changes.emplace_back(ReplaceElements{beyond, {}, {}});
    else
      operation.changes.emplace_back(
          ReplaceElements{index, {{0, 0, static_cast<std::int32_t>(vertices)}}, {}});
    return operation;
  }
  AddOperation other = draw_mesh(draws, after);
  ReplaceBody change{index, std::move(other.addition), std::move(other.positions)};
  switch (draws.below(4)) {
    case 0:
      change.index = beyond;
      break;
    case 1:
      change.addition.body.kind = BodyKind::kRemoved;
      break;
    case 2:
      change.addition.body.mask = 0;
      break;
    default:
      change.addition.edges.push_back({0, static_cast<std::int32_t>(change.addition.body.vertex_count)});
      break;
  }
  operation.changes.emplace_back(std::move(change));
  return operation;
}

}  // namespace warmfront::testing

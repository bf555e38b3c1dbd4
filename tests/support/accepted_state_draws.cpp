// SPDX-License-Identifier: Apache-2.0
// Scenes and operations at random.
#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <utility>

#include "tests/support/accepted_state.h"
#include "tests/support/accepted_state_parts.h"
#include "tests/support/brute_force.h"
#include "tests/support/scenes.h"

namespace warmfront::testing {
namespace {

// A turn about the middle of the scene, and a shift; of a half-space, about its point and to the middle.
Pose draw_pose(Draws& draws, double step, const AcceptedState& state, std::uint32_t body) {
  const double angle = draws.below(4) == 0 ? draws.uniform(3)
                       : step == 0         ? draws.uniform(0.1)
                                           : draws.uniform(step / state.unit);
  Pose pose;
  const int axis = draws.below(3);
  const int u = (axis + 1) % 3;
  const int v = (axis + 2) % 3;
  pose.matrix[4 * u + u] = pose.matrix[4 * v + v] = std::cos(angle);
  pose.matrix[4 * u + v] = -std::sin(angle);
  pose.matrix[4 * v + u] = std::sin(angle);
  std::array<double, 3> about{state.offset, state.offset, state.offset};
  if (state.scene.bodies[body].half_space) about = state.scene.bodies[body].half_space->point;
  for (int row = 0; row < 3; ++row) {
    double turned = 0;
    for (int column = 0; column < 3; ++column)
      turned += pose.matrix[4 * row + column] * about[static_cast<std::size_t>(column)];
    pose.matrix[4 * row + 3] = state.offset - turned + draws.uniform(step);
  }
  return pose;
}

double draw_length(Draws& draws) {
  switch (draws.below(8)) {
    case 0:
      return 0;
    case 1:
      return 1.5;
    case 2:
      return 0.02;
    default:
      return 0.15;
  }
}

// The body's rows, moved as a whole and, some, on their own.
std::vector<double> moved_rows(Draws& draws, const Body& body, const std::vector<double>& from, double step) {
  std::vector<double> rows(from.begin() + first_number(body),
                           from.begin() + first_number(body) + numbers(body));
  const double drift[3] = {draws.uniform(step), draws.uniform(step), draws.uniform(step)};
  for (std::size_t i = 0; i < rows.size(); ++i)
    rows[i] += drift[i % 3] + (draws.below(3) == 0 ? draws.uniform(step) : 0);
  return rows;
}

}  // namespace

Shape draw_shape(Draws& draws) {
  std::mt19937_64 random(static_cast<std::uint64_t>(draws.below(1 << 30)));
  const RandomScene drawn = random_scene(random);
  Shape shape{{}, {}, drawn.positions};
  append_elements(*drawn.scene, 0, shape.faces, shape.edges);
  return shape;
}

Body draw_body(Draws& draws, std::size_t vertex_count, double unit, bool may_turn) {
  Body body{"", 0, static_cast<std::uint32_t>(vertex_count), static_cast<BodyKind>(draws.below(3))};
  body.screw = may_turn && body.kind == BodyKind::kRigid && draws.below(2) == 0;
  body.self_collision = draws.below(4) != 0;
  if (draws.below(4) == 0) {
    body.group = 1U << draws.below(2);
    body.mask = 1U + static_cast<std::uint32_t>(draws.below(3));
  }
  if (draws.below(3) == 0) body.world = static_cast<std::uint32_t>(draws.below(3)) * 7;
  if (draws.below(4) == 0) body.thickness = 0.02 * (1 + draws.below(5)) * unit;
  return body;
}

Body draw_half_space(Draws& draws, double unit, double offset) {
  Body body = draw_body(draws, 0, unit, false);
  body.kind = draws.below(2) == 0 ? BodyKind::kStatic : BodyKind::kRigid;
  HalfSpace& half_space = body.half_space.emplace();
  for (double& x : half_space.point) x = offset + draws.uniform(0.5 * unit);
  if (draws.below(2) == 0) {
    half_space.normal[static_cast<std::size_t>(draws.below(3))] = draws.below(2) == 0 ? 1 : -1;
  } else {
    const double length = std::ldexp(1.0, draws.below(4) == 0 ? 200 * (draws.below(9) - 4) : 0);
    for (double& n : half_space.normal) n = draws.uniform(length);
  }
  return body;
}

AcceptedState draw_state(Draws& draws) {
  SceneDescription scene;
  std::vector<double> positions;
  const int bodies = 1 + draws.below(4);
  const bool may_turn = draws.below(2) == 0;
  const auto maybe_half_space = [&] {
    if (draws.below(4) != 0) return;
    Body body = draw_half_space(draws, 1, 0);
    body.first_vertex = scene.vertex_count;
    scene.bodies.push_back(body);
  };
  maybe_half_space();
  for (int b = 0; b < bodies; ++b) {
    const Shape shape = draw_shape(draws);
    Body body = draw_body(draws, shape.positions.size() / 3, 1, may_turn);
    body.first_vertex = scene.vertex_count;
    append(shape.faces, shape.edges, scene);
    scene.vertex_count += body.vertex_count;
    scene.bodies.push_back(body);
    positions.insert(positions.end(), shape.positions.begin(), shape.positions.end());
    maybe_half_space();
  }
  if (scene.bodies.size() > 1 && draws.below(3) == 0)
    scene.excluded_pairs.push_back(
        {0, static_cast<std::uint32_t>(1 + draws.below(static_cast<int>(scene.bodies.size()) - 1))});
  if (draws.below(6) == 0) {
    scene.bodies.clear();
    scene.excluded_pairs.clear();
  }
  if (bodies > 1 && draws.below(4) == 0) {  // faces of bodies in turns
    for (std::size_t f = scene.faces.size(); f > 1; --f)
      std::swap(scene.faces[f - 1], scene.faces[static_cast<std::size_t>(draws.below(static_cast<int>(f)))]);
  }
  if (draws.below(8) == 0) {
    for (std::uint32_t v = 0; v < scene.vertex_count; ++v) scene.thickness.push_back(draws.below(3) * 0.01);
  }
  AcceptedState state(std::move(scene), std::move(positions));
  state.may_turn = may_turn;
  return state;
}

AcceptedState scaled(AcceptedState state, double unit, double offset) {
  for (double& x : state.positions) x = x * unit + offset * unit;
  for (double& thickness : state.scene.thickness) thickness *= unit;
  for (Body& body : state.scene.bodies) {
    body.thickness *= unit;
    if (!body.half_space) continue;
    for (double& x : body.half_space->point) x = x * unit + offset * unit;
  }
  state.reference = state.positions;
  state.unit = unit;
  state.offset = offset * unit;
  return state;
}

StepOperation draw_step(Draws& draws, const AcceptedState& state) {
  StepOperation operation;
  const double step = draw_length(draws) * state.unit;
  if (draws.below(10) == 0) return operation;  // nothing is mentioned
  const bool whole = draws.below(4) == 0 || (state.scene.bodies.empty() && draws.below(2) == 0);
  if (whole) operation.all = state.positions;
  const auto draw_vertices = [&](std::uint32_t first, std::uint32_t end) {
    for (std::uint32_t v = first; v < end; ++v) {
      if (draws.below(4) != 0) continue;
      operation.vertices.push_back(v);
      for (int axis = 0; axis < 3; ++axis)
        operation.vertex_positions.push_back(state.positions[std::size_t{3} * v + axis] +
                                             draws.uniform(step));
    }
  };
  if (state.scene.bodies.empty()) {
    if (!whole) {
      draw_vertices(0, state.scene.vertex_count);
    } else {
      for (double& x : *operation.all) x += draws.uniform(step);
    }
    return operation;
  }
  for (std::uint32_t b = 0; b < state.scene.bodies.size(); ++b) {
    const Body& body = state.scene.bodies[b];
    if (state.fixed(b) || draws.below(3) == 0) continue;
    if (whole) {
      const std::vector<double> rows = moved_rows(draws, body, state.positions, step);
      std::ranges::copy(rows, operation.all->begin() + first_number(body));
    } else if (body.half_space || (body.kind == BodyKind::kRigid && draws.below(4) != 0)) {
      operation.poses.push_back({b, draw_pose(draws, step, state, b)});
    } else if (body.kind == BodyKind::kRigid || draws.below(2) == 0) {
      operation.bodies.push_back({b, moved_rows(draws, body, state.positions, step)});
    } else {
      draw_vertices(body.first_vertex, body.first_vertex + body.vertex_count);
    }
  }
  return operation;
}

QuestionOptions draw_question(Draws& draws, const AcceptedState& state) {
  QuestionOptions options;
  if (draws.below(2) == 0) return options;
  if (state.travels != AcceptedState::Travels::kMoving && draws.below(3) == 0)
    options.tier = static_cast<Tier>(draws.below(3));
  if (draws.below(4) == 0) options.tolerance = 1e-3;
  if (draws.below(2) == 0)
    options.min_separation = std::array{0.0, 0.02, 0.1, 0.3}[draws.below(4)] * state.unit;
  if (draws.below(2) == 0) options.report = static_cast<Report>(draws.below(4));
  if (draws.below(3) == 0)
    options.fields = ContactFields{.weights = draws.below(2) == 0,
                                   .normal = draws.below(2) == 0,
                                   .points = true,
                                   .direction = draws.below(2) == 0,
                                   .squared_distance = draws.below(2) == 0,
                                   .closest = draws.below(2) == 0};
  if (draws.below(6) == 0) options.max_contacts = static_cast<std::size_t>(draws.below(30));
  return options;
}

NearOperation draw_near(Draws& draws, const AcceptedState& state) {
  NearOperation near;
  near.distance = std::array{0.0, 0.02, 0.1, 0.3}[draws.below(4)] * state.unit;
  if (state.trial && draws.below(2) == 0) near.where = Where::kTrialEnd;
  near.options = draw_question(draws, state);
  near.options.min_separation.reset();
  near.tangled = draws.below(3) == 0;
  if (near.tangled) {
    near.options = {.report = near.options.report, .max_contacts = near.options.max_contacts};
    if (draws.below(3) == 0) near.options.report = Report::kAny;
  } else if (draws.below(3) == 0) {
    near.options.report = Report::kVertexDistances;
    near.options.fields.reset();
  } else {
    near.options.reduced = draws.below(3) == 0;
  }
  return near;
}

AddOperation draw_addition(Draws& draws, const AcceptedState& state) {
  if (draws.below(4) == 0) return {{draw_half_space(draws, state.unit, state.offset), {}}, {}};
  Shape shape = draw_shape(draws);
  for (double& x : shape.positions) x = x * state.unit + state.offset;
  const Body body = draw_body(draws, shape.positions.size() / 3, state.unit, state.may_turn);
  std::vector<double> thickness;
  for (std::uint32_t v = draws.below(4) == 0 ? 0 : body.vertex_count; v < body.vertex_count; ++v)
    thickness.push_back(draws.below(3) * 0.01 * state.unit);
  return {{body, std::move(shape.faces), std::move(shape.edges), std::move(thickness)},
          std::move(shape.positions)};
}

ChangeOperation draw_change(Draws& draws, const AcceptedState& state) {
  const auto index = static_cast<std::uint32_t>(draws.below(static_cast<int>(state.scene.bodies.size())));
  const Body& body = state.scene.bodies[index];
  Body changed = body.half_space ? draw_half_space(draws, state.unit, state.offset)
                                 : draw_body(draws, body.vertex_count, state.unit, state.may_turn);
  if (body.half_space && draws.below(2) == 0) changed.half_space = body.half_space;
  changed.first_vertex = body.first_vertex;
  if (draws.below(6) == 0) changed.kind = BodyKind::kRemoved;
  return {index, changed};
}

ChangesOperation draw_filters(Draws& draws, const AcceptedState& state) {
  PairFilters filters;
  const auto vertices = static_cast<int>(state.scene.vertex_count);
  if (draws.below(4) == 0) return {{ChangeFilters{filters}}};
  if (draws.below(2) == 0) filters.within_edges = static_cast<std::uint32_t>(draws.below(4));
  if (draws.below(3) == 0) {
    filters.near_at_rest = 0.1 * (1 + draws.below(5)) * state.unit;
    filters.rest_positions = state.positions;
  }
  for (int i = draws.below(5); i > 0; --i) {
    const auto a = static_cast<std::uint32_t>(draws.below(vertices));
    const auto b = static_cast<std::uint32_t>(draws.below(vertices));
    if (a != b) filters.excluded_vertex_pairs.push_back({a, b});
  }
  if (draws.below(2) == 0) {
    for (int v = 0; v < vertices; ++v)
      filters.patches.push_back(static_cast<std::uint32_t>(draws.below(6) == 0 ? 0 : 1 + 2 * v / vertices));
  }
  return {{ChangeFilters{filters}}};
}

ChangeExcludedPairs draw_excluded_pairs(Draws& draws, const AcceptedState& state) {
  ChangeExcludedPairs other;
  const auto bodies = static_cast<int>(state.scene.bodies.size());
  for (int i = draws.below(4); bodies > 1 && i > 0; --i) {
    const auto a = static_cast<std::uint32_t>(draws.below(bodies));
    const auto b = static_cast<std::uint32_t>(draws.below(bodies));
    if (a != b) other.pairs.push_back({a, b});
  }
  return other;
}

ColliderOptions draw_other_options(Draws& draws, ColliderOptions options, double unit) {
  switch (draws.below(4)) {
    case 0:
      options.front = static_cast<FrontMode>(draws.below(3));
      options.lazy_front = draws.below(2) == 0;
      break;
    case 1:
      options.separate_parts = draws.below(2) == 0;
      options.find_rigid = draws.below(2) == 0;
      break;
    case 2:
      options.fields = {.weights = draws.below(2) == 0, .direction = draws.below(2) == 0};
      break;
    default:
      break;
  }
  if (draws.below(2) == 0) options.tier = draws.below(3) == 0 ? Tier::kExact : Tier::kCertified;
  if (draws.below(2) == 0) options.min_separation = 0.03 * draws.below(4) * unit;
  if (draws.below(3) == 0) options.tolerance = 1e-4;
  if (draws.below(3) == 0) options.report = static_cast<Report>(draws.below(3));
  return options;
}

PlaceOperation draw_place(Draws& draws, const AcceptedState& state) {
  PlaceOperation place;
  for (std::uint32_t b = 0; b < state.scene.bodies.size(); ++b) {
    if (state.scene.bodies[b].kind == BodyKind::kRigid && draws.below(3) != 0)
      place.poses.push_back({b, draw_pose(draws, 0.5 * state.unit, state, b)});
  }
  return place;
}

}  // namespace warmfront::testing

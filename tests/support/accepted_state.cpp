// SPDX-License-Identifier: Apache-2.0
// What accepted operations make of the state. The oracle: accepted_state_brute_force.cpp; operations at
// random: accepted_state_draws.cpp.
#include "tests/support/accepted_state.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <map>
#include <random>
#include <set>
#include <stdexcept>
#include <utility>

#include "engine/elementary/candidate.h"
#include "engine/elementary/contact_geometry.h"
#include "engine/elementary/edge_face.h"
#include "engine/elementary/elementary_test.h"
#include "engine/elementary/half_space.h"
#include "engine/elementary/keep_distance.h"
#include "engine/elementary/proximity.h"
#include "engine/part_way.h"
#include "engine/scene/thickness.h"
#include "engine/screw.h"
#include "tests/support/accepted_state_parts.h"
#include "tests/support/brute_force.h"
#include "tests/support/pair_rules.h"
#include "tests/support/reduced_oracle.h"
#include "tests/support/replacements.h"
#include "tests/support/scenes.h"

namespace warmfront::testing {
namespace {

void copy_body(const Body& body, const std::vector<double>& from, std::vector<double>& to) {
  std::copy_n(from.begin() + first_number(body), numbers(body), to.begin() + first_number(body));
}

}  // namespace

std::vector<double> target_of(const AcceptedState& state, const StepOperation& step) {
  if (step.all) return *step.all;
  std::vector<double> next = state.positions;
  for (const auto& [body, rows] : step.bodies)
    std::ranges::copy(rows, next.begin() + first_number(state.scene.bodies[body]));
  for (const BodyPose& pose : step.poses) {
    const Body& body = state.scene.bodies[pose.body];
    for (std::ptrdiff_t i = first_number(body); i < first_number(body) + numbers(body); i += 3) {
      // A pose is of the positions last given.
      const auto& shape = state.pose[pose.body] ? state.reference : state.positions;
      std::ranges::copy(pose.pose.place(shape.data() + i), next.begin() + i);
    }
  }
  for (std::size_t i = 0; i < step.vertices.size(); ++i)
    std::copy_n(step.vertex_positions.begin() + static_cast<std::ptrdiff_t>(3 * i), 3,
                next.begin() + std::ptrdiff_t{3} * step.vertices[i]);
  return next;
}

void append(const Faces& faces, const Edges& edges, SceneDescription& to) {
  const auto first = static_cast<std::int32_t>(to.vertex_count);
  for (const auto& [a, b, c] : faces) to.faces.push_back({a + first, b + first, c + first});
  for (const auto& [a, b] : edges) to.edges.push_back({a + first, b + first});
}

namespace {

void accept_poses(AcceptedState& state, const std::vector<BodyPose>& poses) {
  for (const BodyPose& pose : poses) {
    const Body& body = state.scene.bodies[pose.body];
    if (!state.pose[pose.body]) copy_body(body, state.positions, state.reference);
    state.pose[pose.body] = pose.pose;
  }
}

void accept_step(AcceptedState& state, const StepOperation& step) {
  std::vector<double> next = target_of(state, step);
  accept_poses(state, step.poses);
  state.positions = std::move(next);
  for (std::size_t b = 0; b < state.scene.bodies.size(); ++b) {
    if (step.all && !state.fixed(b) && !state.scene.bodies[b].half_space) state.pose[b].reset();
  }
  for (const auto& rows : step.bodies) state.pose[rows.body].reset();
  state.stepped = true;
}

void accept_commit(AcceptedState& state, const CommitOperation& commit) {
  const StepOperation step = *state.trial;
  const double f = commit.fraction;
  if (f == 0) return;
  if (f == 1) return accept_step(state, step);
  const bool single = commit.rounding == Rounding::kFloat32;
  const std::vector<std::optional<Pose>> from = state.pose;
  const std::vector<double> start = state.positions;
  accept_step(state, step);
  for (std::size_t v = 0; v < start.size(); v += 3) {
    if (std::memcmp(&start[v], &state.positions[v], 3 * sizeof(double)) == 0) continue;
    for (std::size_t i = v; i < v + 3; ++i)
      state.positions[i] = part_way(start[i], state.positions[i], f, single);
  }
  for (const BodyPose& pose : step.poses) {
    Pose& to = *state.pose[pose.body];
    const Pose before = from[pose.body].value_or(Pose{});
    const Body& body = state.scene.bodies[pose.body];
    if (!(to == before)) to = body.screw ? screw_way(before, to, f, single) : part_way(before, to, f, single);
    for (std::ptrdiff_t i = first_number(body); i < first_number(body) + numbers(body); i += 3)
      std::ranges::copy(to.place(state.reference.data() + i), state.positions.begin() + i);
  }
}

void accept_addition(AcceptedState& state, const AddOperation& add) {
  Body body = add.addition.body;
  body.first_vertex = state.scene.vertex_count;
  append(add.addition.faces, add.addition.edges, state.scene);
  state.scene.vertex_count += body.vertex_count;
  state.scene.bodies.push_back(body);
  std::vector<double>& thickness = state.scene.thickness;
  if (!add.addition.thickness.empty()) thickness.resize(body.first_vertex, 0.0);
  thickness.insert(thickness.end(), add.addition.thickness.begin(), add.addition.thickness.end());
  if (!thickness.empty()) thickness.resize(state.scene.vertex_count, 0.0);
  PairFilters& filters = state.scene.filters;
  if (!filters.patches.empty()) filters.patches.resize(state.scene.vertex_count, 0);
  if (filters.near_at_rest > 0)
    filters.rest_positions.insert(filters.rest_positions.end(), add.positions.begin(), add.positions.end());
  state.positions.insert(state.positions.end(), add.positions.begin(), add.positions.end());
  state.reference.insert(state.reference.end(), add.positions.begin(), add.positions.end());
  state.pose.emplace_back();
}

void accept_change(AcceptedState& state, const ChangeOperation& change) {
  Body& body = state.scene.bodies[change.body];
  const Body was = std::exchange(body, change.as);
  body.first_vertex = was.first_vertex;
  body.vertex_count = was.vertex_count;
  if (!body.half_space) body.half_space = was.half_space;  // of one that is removed
  if (body.kind != was.kind || body.half_space != was.half_space)
    state.pose[change.body].reset();  // where it is, is its reference shape
}

}  // namespace

AcceptedState::AcceptedState(SceneDescription the_scene, std::vector<double> the_positions)
    : scene(std::move(the_scene)),
      positions(std::move(the_positions)),
      reference(positions),
      pose(scene.bodies.size()) {}

bool AcceptedState::fixed(std::size_t body) const {
  return scene.bodies[body].kind == BodyKind::kStatic || scene.bodies[body].kind == BodyKind::kRemoved;
}

void AcceptedState::accept(const Operation& operation) {
  const auto* step = std::get_if<StepOperation>(&operation);
  if (step != nullptr && (step->as == StepOperation::As::kTrial || step->as == StepOperation::As::kMaxStep)) {
    trial = *step;
    return;
  }
  if (step != nullptr) accept_step(*this, *step);
  if (const auto* commit = std::get_if<CommitOperation>(&operation)) accept_commit(*this, *commit);
  if (!std::holds_alternative<CheckOperation>(operation) &&
      !std::holds_alternative<ForgetOperation>(operation) &&
      !std::holds_alternative<NearOperation>(operation))
    trial.reset();
  if (const auto* add = std::get_if<AddOperation>(&operation)) accept_addition(*this, *add);
  if (const auto* change = std::get_if<ChangeOperation>(&operation)) accept_change(*this, *change);
  if (const auto* several = std::get_if<ChangesOperation>(&operation)) {
    for (const SceneChange& one : several->changes) {
      if (const auto* add = std::get_if<AddBody>(&one)) {
        accept_addition(*this, {add->addition, add->positions});
      } else if (const auto* other = std::get_if<ChangeFilters>(&one)) {
        scene.filters = other->filters;
      } else if (const auto* pairs = std::get_if<ChangeExcludedPairs>(&one)) {
        scene.excluded_pairs = pairs->pairs;
      } else if (const auto* elements = std::get_if<ReplaceElements>(&one)) {
        accept_replacement(*this, *elements);
      } else if (const auto* replaced = std::get_if<ReplaceBody>(&one)) {
        accept_replacement(*this, *replaced);
      } else {
        const auto& change = std::get<ChangeBody>(one);
        accept_change(*this, {change.index, change.body});
      }
    }
  }
  if (const auto* place = std::get_if<PlaceOperation>(&operation)) {
    StepOperation step;
    step.poses = place->poses;
    const bool stepped_before = stepped;
    accept_step(*this, step);
    stepped = stepped_before;
  }
}

Collider AcceptedState::fresh(const ColliderOptions& options, const std::shared_ptr<Workers>& workers) const {
  Result<Scene> made = Scene::create(scene);
  if (!made) throw std::logic_error(made.error().message);
  std::vector<double> start = positions;
  std::vector<BodyPose> poses;
  for (std::uint32_t b = 0; b < scene.bodies.size(); ++b) {
    if (!pose[b]) continue;
    copy_body(scene.bodies[b], reference, start);
    poses.push_back({b, *pose[b]});
  }
  Result<Collider> collider = Collider::create(std::make_shared<const Scene>(std::move(made).value()),
                                               std::span<const double>(start), options, workers);
  if (!collider) throw std::logic_error(collider.error().message);
  if (Status placed = collider.value().place(poses); !placed) throw std::logic_error(placed.error().message);
  return std::move(collider).value();
}

std::string AcceptedState::difference(std::span<const double> shown, std::span<const BodyPose> poses,
                                      bool of_removed) const {
  if (shown.size() != positions.size())
    return std::to_string(shown.size() / 3) + " vertices where " + std::to_string(positions.size() / 3) +
           " are expected";
  std::vector<double> expected = positions;
  for (const Body& body : scene.bodies) {
    if (!of_removed && body.kind == BodyKind::kRemoved)
      std::copy_n(shown.begin() + first_number(body), numbers(body), expected.begin() + first_number(body));
  }
  for (std::size_t i = 0; i < shown.size(); ++i) {
    if (std::memcmp(&shown[i], &expected[i], sizeof(double)) != 0)
      return "positions[" + std::to_string(i / 3) + "]." + "xyz"[i % 3] + " is " + std::to_string(shown[i]) +
             " where " + std::to_string(positions[i]) + " is expected";
  }
  auto next = poses.begin();
  for (std::uint32_t b = 0; b < scene.bodies.size(); ++b) {
    if (scene.bodies[b].kind != BodyKind::kRigid) continue;
    if (next == poses.end() || next->body != b || !(next->pose == pose[b].value_or(Pose{})))
      return "the pose of body " + std::to_string(b) + " differs";
    ++next;
  }
  return next == poses.end() ? "" : "there is a pose of a body that is not rigid";
}

std::string AcceptedState::difference(const Collider& collider) const {
  if (std::string differs = difference(collider.positions(), collider.poses(), true); !differs.empty())
    return differs;
  const Scene& has = collider.scene();
  if (has.vertex_count() != scene.vertex_count) return "scene().vertex_count() differs";
  if (!std::ranges::equal(has.bodies(), scene.bodies)) return "scene().bodies() differ";
  if (!std::ranges::equal(has.excluded_pairs(), scene.excluded_pairs))
    return "scene().excluded_pairs() differ";
  if (!(has.filters() == scene.filters)) return "scene().filters() differ";
  const bool same_faces = std::ranges::equal(has.faces(), scene.faces, [](const Face& a, const auto& b) {
    return std::ranges::equal(a, b, [](std::uint32_t x, std::int32_t y) { return std::cmp_equal(x, y); });
  });
  if (!same_faces) return "scene().faces() differ";
  std::set<Edge> lone;
  for (const std::uint32_t e : has.lone_edges()) lone.insert(has.edges()[e]);
  std::set<Edge> expected;
  for (const auto& [a, b] : scene.edges)
    expected.insert({static_cast<std::uint32_t>(std::min(a, b)), static_cast<std::uint32_t>(std::max(a, b))});
  for (const auto& face : scene.faces) {
    for (int side = 0; side < 3; ++side) {
      const auto [a, b] = std::minmax(face[side], face[(side + 1) % 3]);
      expected.erase({static_cast<std::uint32_t>(a), static_cast<std::uint32_t>(b)});
    }
  }
  return lone == expected ? "" : "scene().lone_edges() differ";
}

}  // namespace warmfront::testing

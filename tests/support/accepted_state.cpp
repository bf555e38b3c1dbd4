// SPDX-License-Identifier: Apache-2.0
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
#include "engine/scene/screws.h"
#include "engine/screw.h"
#include "engine/scene/thickness.h"
#include "tests/support/brute_force.h"
#include "tests/support/pair_rules.h"
#include "tests/support/reduced_oracle.h"
#include "tests/support/replacements.h"
#include "tests/support/scenes.h"

namespace warmfront::testing {
namespace {

std::ptrdiff_t first_number(const Body& body) {
  return std::ptrdiff_t{3} * body.first_vertex;
}
std::ptrdiff_t numbers(const Body& body) {
  return std::ptrdiff_t{3} * body.vertex_count;
}

void copy_body(const Body& body, const std::vector<double>& from, std::vector<double>& to) {
  std::copy_n(from.begin() + first_number(body), numbers(body), to.begin() + first_number(body));
}

// Where the step puts everything.
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
    if (!(to == before))
      to = body.screw ? screw_way(before, to, f, single) : part_way(before, to, f, single);
    for (std::ptrdiff_t i = first_number(body); i < first_number(body) + numbers(body); i += 3)
      std::ranges::copy(to.place(state.reference.data() + i), state.positions.begin() + i);
  }
}

// Elements that number their own vertices from 0: of vertices to be added.
void append(const Faces& faces, const Edges& edges, SceneDescription& to) {
  const auto first = static_cast<std::int32_t>(to.vertex_count);
  for (const auto& [a, b, c] : faces) to.faces.push_back({a + first, b + first, c + first});
  for (const auto& [a, b] : edges) to.edges.push_back({a + first, b + first});
}

void accept_addition(AcceptedState& state, const AddOperation& add) {
  Body body = add.addition.body;
  body.first_vertex = state.scene.vertex_count;
  append(add.addition.faces, add.addition.edges, state.scene);
  state.scene.vertex_count += body.vertex_count;
  state.scene.bodies.push_back(body);
  std::vector<double>& thickness = state.scene.thickness;
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

bool may_meet(const SceneDescription& scene, std::uint32_t p, std::uint32_t q) {
  if (scene.bodies.empty()) return true;
  const Body& a = scene.bodies[p];
  const Body& b = scene.bodies[q];
  if (a.kind == BodyKind::kRemoved || b.kind == BodyKind::kRemoved) return false;
  if (p == q) return a.kind == BodyKind::kDeformable && a.self_collision;
  if (a.kind == BodyKind::kStatic && b.kind == BodyKind::kStatic) return false;
  if ((a.group & b.mask) == 0 || (b.group & a.mask) == 0) return false;
  if (a.world != b.world && a.world != 0 && b.world != 0) return false;
  return std::ranges::none_of(scene.excluded_pairs, [&](const auto& pair) {
    return (pair[0] == p && pair[1] == q) || (pair[0] == q && pair[1] == p);
  });
}

// The numbers of the worlds that bodies are in, where any has one.
std::map<std::uint32_t, double> worlds_of(const SceneDescription& scene) {
  std::map<std::uint32_t, double> least;
  for (const Body& body : scene.bodies) {
    if (body.kind != BodyKind::kRemoved) least.emplace(body.world, std::numeric_limits<double>::infinity());
  }
  if (least.size() == 1 && least.contains(0)) least.clear();
  return least;
}

std::uint32_t world_of(const Scene& scene, const Contact& contact) {
  const auto vertices = scene.vertices_of(contact);
  const auto world = [&](std::uint32_t v) { return scene.bodies()[scene.body_of_vertex()[v]].world; };
  if (contact.kind == ContactKind::kVertexHalfSpace)
    return std::max(world(contact.a), scene.bodies()[contact.b].world);
  return world(vertices.front()) != 0 ? world(vertices.front()) : world(vertices.back());
}

// What of all contacts the options ask for.
Outcome answer_of(std::vector<Contact> contacts, const SceneDescription& scene, const Scene& made,
                  const ColliderOptions& options) {
  Outcome outcome;
  if (options.leave_out_overlaps)
    std::erase_if(contacts, [](const Contact& c) { return c.status == ContactStatus::kOverlapAtStart; });
  for (const Contact& contact : contacts)
    outcome.earliest_toi = std::min(outcome.earliest_toi.value_or(2), contact.toi);
  if (options.report == Report::kEarliest) {
    std::map<std::uint32_t, double> least = worlds_of(scene);
    if (least.empty()) {
      std::erase_if(contacts, [&](const Contact& contact) { return contact.toi > *outcome.earliest_toi; });
    } else {
      for (const Contact& contact : contacts) {
        double& of_world = least.at(world_of(made, contact));
        of_world = std::min(of_world, contact.toi);
      }
      std::erase_if(contacts,
                    [&](const Contact& contact) { return contact.toi > least.at(world_of(made, contact)); });
      for (const auto& [world, toi] : least) {
        outcome.worlds.push_back(world);
        outcome.world_tois.push_back(toi);
      }
    }
  }
  const bool lists = options.report != Report::kCount && options.report != Report::kVertexDistances &&
                     options.report != Report::kAny;
  if (lists && contacts.size() > options.max_contacts) {
    Outcome refused;
    refused.kind = Outcome::Kind::kRefused;
    refused.error = {ErrorCode::kResourceExhausted, "max_contacts"};
    return refused;
  }
  for (const Contact& contact : contacts) {
    (contact.kind == ContactKind::kVertexFace        ? outcome.vf
     : contact.kind == ContactKind::kEdgeFace        ? outcome.ef
     : contact.kind == ContactKind::kVertexHalfSpace ? outcome.vh
                                                     : outcome.ee) += 1;
    outcome.possible +=
        contact.status == ContactStatus::kPossible || contact.status == ContactStatus::kBudget;
  }
  if (options.report == Report::kAny) outcome.ef = std::min<std::uint64_t>(outcome.ef, 1);
  if (lists) outcome.contacts = std::move(contacts);
  return outcome;
}

// A shape whose faces and edges count from 0.
struct Shape {
  Faces faces;
  Edges edges;
  std::vector<double> positions;
};
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

// Near the middle of the scene, at any slope; some normals are exact, long or short.
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

// A turn about the middle of the scene, and a shift.
Pose draw_pose(Draws& draws, double step, const AcceptedState& state) {
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
  for (int row = 0; row < 3; ++row) {
    double turned = 0;
    for (int column = 0; column < 3; ++column) turned += pose.matrix[4 * row + column] * state.offset;
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

std::string AcceptedState::difference(const Collider& collider) const {
  const std::vector<double> shown = collider.positions();
  if (shown.size() != positions.size())
    return std::to_string(shown.size() / 3) + " vertices where " + std::to_string(positions.size() / 3) +
           " are expected";
  for (std::size_t i = 0; i < shown.size(); ++i) {
    if (std::memcmp(&shown[i], &positions[i], sizeof(double)) != 0)
      return "positions[" + std::to_string(i / 3) + "]." + "xyz"[i % 3] + " is " + std::to_string(shown[i]) +
             " where " + std::to_string(positions[i]) + " is expected";
  }
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

namespace {

Outcome refusal(const Status& why) {
  Outcome refused;
  refused.kind = Outcome::Kind::kRefused;
  refused.error = why.error();
  return refused;
}

double thickness_of(const Scene& made, std::span<const std::uint32_t> vertices) {
  double most = 0;
  for (const std::uint32_t v : vertices) most = std::max(most, made.thickness_of(v));
  return most;
}

// Of both features of a pair.
double thickness_of(const Scene& made, const Contact& pair) {
  const auto ids = made.vertices_of(pair);
  const std::span<const std::uint32_t> all(ids);
  const std::size_t of_a = vertices_of_first(pair.kind);
  return thickness_of(made, all.first(of_a)) + thickness_of(made, all.subspan(of_a));
}

// All that `test`, of two features with their twists and how thick both are together, finds of the pairs that the scene allows,
// one by one; in a question with this separation.
template <class Test>
std::vector<Contact> found_by(const SceneDescription& scene, const Scene& made,
                              std::span<const VertexMotion> vertices, const Twists& twists, double separation,
                              Test&& test) {
  std::vector<Contact> contacts;
  const PairRules rules(made, scene.filters);
  for_all_pairs(made, true, [&](ContactKind kind, std::uint32_t a, std::uint32_t b) {
    const auto ids = made.vertices_of({kind, ContactStatus::kHit, a, b, 0});
    if (!may_meet(scene, made.body_of_vertex()[ids[0]], made.body_of_vertex()[ids[3]])) return;
    const double thickness = thickness_of(made, {kind, ContactStatus::kHit, a, b, 0});
    const bool of_points = kind == ContactKind::kVertexEdge || kind == ContactKind::kVertexVertex;
    if (of_points && separation + thickness == 0) return;
    const FeatureVertices features = features_of(made, vertices, kind, a, b);
    const Verdict verdict = test(turning_pair(made, twists, features, kind, a, b), thickness);
    if (!verdict.contact) return;
    const Contact contact{kind, verdict.status, a, b, verdict.toi};
    if (!rules.leave_out(contact)) contacts.push_back(contact);
  });
  return contacts;
}

// All edges and faces of what may meet that do, and share no vertex.
std::vector<Contact> meeting_edges_and_faces(const SceneDescription& scene, const Scene& made,
                                             std::span<const VertexMotion> vertices, Instant at) {
  std::vector<Contact> meeting;
  std::uint64_t exact_tests = 0;
  for (std::uint32_t e = 0; e < made.edge_count(); ++e) {
    for (std::uint32_t f = 0; f < made.face_count(); ++f) {
      const Edge& edge = made.edges()[e];
      const Face& face = made.faces()[f];
      const auto in_face = [&](std::uint32_t v) { return std::ranges::find(face, v) != face.end(); };
      if (in_face(edge[0]) || in_face(edge[1])) continue;
      if (!may_meet(scene, made.body_of_vertex()[edge[0]], made.body_of_vertex()[face[0]])) continue;
      const EdgeFaceVertices five{&vertices[edge[0]], &vertices[edge[1]], &vertices[face[0]],
                                  &vertices[face[1]], &vertices[face[2]]};
      if (edge_meets_face(five, at, exact_tests))
        meeting.push_back(
            {ContactKind::kEdgeFace, ContactStatus::kHit, e, f, at == Instant::kStart ? 0.0 : 1.0});
    }
  }
  return meeting;
}

// By body: what poses of a step turn along screws.
Twists twists_of(const AcceptedState& state, const StepOperation& step) {
  Twists twists(state.scene.bodies.size());
  for (const BodyPose& pose : step.poses) {
    if (state.scene.bodies[pose.body].screw)
      twists[pose.body] = twist_between(state.pose[pose.body].value_or(Pose{}), pose.pose);
  }
  return twists;
}

// By body: half-spaces on their way from where they are to where a step, if any, takes them.
std::vector<HalfSpaceMotion> half_spaces_of(const AcceptedState& state, const StepOperation* step) {
  std::vector<HalfSpaceMotion> all(state.scene.bodies.size());
  for (std::uint32_t b = 0; b < all.size(); ++b) {
    const std::optional<HalfSpace>& at_rest = state.scene.bodies[b].half_space;
    if (!at_rest) continue;
    std::array<Pose, 2> poses;
    poses.fill(state.pose[b].value_or(Pose{}));
    for (const BodyPose& pose : step != nullptr ? step->poses : std::vector<BodyPose>()) {
      if (pose.body == b) poses[1] = pose.pose;
    }
    for (std::size_t end = 0; end < 2; ++end) {
      all[b].point[end] = poses[end].place(at_rest->point.data());
      for (const int shift : {3, 7, 11}) poses[end].matrix[static_cast<std::size_t>(shift)] = 0;
      all[b].normal[end] = poses[end].place(at_rest->normal.data());
    }
  }
  return all;
}

// All that `test`, of a vertex, a half-space, and how thick both are together, finds, after `contacts`.
template <class Test>
void add_half_spaces(std::vector<Contact>& contacts, const SceneDescription& scene, const Scene& made,
                     std::span<const VertexMotion> vertices, std::span<const HalfSpaceMotion> half_spaces,
                     const Twists& twists, Test&& test) {
  for (std::uint32_t v = 0; v < made.vertex_count(); ++v) {
    for (std::uint32_t b = 0; b < scene.bodies.size(); ++b) {
      if (!scene.bodies[b].half_space || !may_meet(scene, made.body_of_vertex()[v], b)) continue;
      const double thickness = made.thickness_of(v) + scene.bodies[b].thickness;
      const Verdict verdict = test(vertices[v], half_spaces[b], thickness, twist_around(twists, made, v));
      if (verdict.contact)
        contacts.push_back({ContactKind::kVertexHalfSpace, verdict.status, v, b, verdict.toi});
    }
  }
}

void describe(Outcome& outcome, const Scene& made, std::span<const VertexMotion> vertices,
              std::span<const HalfSpaceMotion> half_spaces, const Twists& twists) {
  // What turns rests where it is then.
  const auto then = [&](std::uint32_t v, double toi) {
    const Twist* twist = twist_around(twists, made, v);
    if (twist == nullptr) return vertices[v];
    const auto at = on_arc(vertices[v], *twist, toi);
    return VertexMotion{at, at};
  };
  for (const Contact& contact : outcome.contacts) {
    if (contact.kind == ContactKind::kVertexHalfSpace) {
      outcome.geometry.push_back(
          half_space_geometry(then(contact.a, contact.toi), half_spaces[contact.b], contact.toi));
      continue;
    }
    std::array<VertexMotion, 4> moving;
    std::array<const VertexMotion*, 4> four;
    const auto ids = made.vertices_of(contact);
    for (std::size_t k = 0; k < 4; ++k) {
      moving[k] = then(ids[k], contact.toi);
      four[k] = &moving[k];
    }
    outcome.geometry.push_back(contact_geometry(contact.kind, four, contact.toi));
  }
}

ElementaryOptions elementary_options(const ColliderOptions& options, double thickness) {
  return {.tier = options.tier,
          .tolerance = options.tolerance,
          .min_separation = options.min_separation + thickness};
}

}  // namespace

Outcome AcceptedState::brute_force(const StepOperation& step, const ColliderOptions& of_session) const {
  if (step.as == StepOperation::As::kPlace) {
    const Status valid = validate(QuestionKind::kPlace, step.options);
    return valid ? Outcome() : refusal(valid);
  }
  ColliderOptions options = merged(of_session, step.options);
  const bool max_step = step.as == StepOperation::As::kMaxStep;
  if (max_step) {
    options.report = Report::kEarliest;
    options.fields = {};
    options.leave_out_overlaps = step.leave_out_overlaps;
  }
  const QuestionKind kind = max_step                               ? QuestionKind::kMaxStep
                            : step.as == StepOperation::As::kTrial ? QuestionKind::kTrial
                                                                   : QuestionKind::kStep;
  for (const Status& valid : {validate(kind, step.options), validate(options)})
    if (!valid) return refusal(valid);
  const Scene made = Scene::create(scene).value();
  if (const Status valid = check_thickness(made.most_thickness(), options); !valid) return refusal(valid);
  if (const Status valid = check_screws(screw_count(scene.bodies) > 0, options); !valid) return refusal(valid);
  const std::vector<VertexMotion> vertices = motion_between(positions, target_of(*this, step));
  const Twists twists = twists_of(*this, step);
  const bool candidates = options.report == Report::kCandidates;
  const CertifiedOptions kept{.tolerance = options.tier == Tier::kExact ? 0x1p-32 : options.tolerance};
  ElementaryCounts counts;
  const auto keep_of = [&](double thickness) {
    return KeepDistance{options.keep_distance.value_or(0), options.min_separation + thickness};
  };
  std::vector<Contact> contacts = found_by(
      scene, made, vertices, twists, options.keep_distance ? 1 : options.min_separation,
      [&](const TurningPair& pair, double thickness) {
        const FeatureVertices& features = pair.features;
        if (pair.first != nullptr || pair.second != nullptr) {
          const double separation = options.min_separation + thickness;
          return options.keep_distance ? turning_keep_distance_test(pair, keep_of(thickness), kept)
                 : candidates          ? turning_candidate_test(pair, separation)
                                       : turning_test(pair, {.tolerance = options.tolerance,
                                                             .min_separation = separation});
        }
        return options.keep_distance ? keep_distance_test(features, keep_of(thickness), kept)
               : candidates          ? candidate_test(features, options.min_separation + thickness)
                            : elementary_test(features, elementary_options(options, thickness), counts);
      });
  const std::vector<HalfSpaceMotion> half_spaces = half_spaces_of(*this, &step);
  add_half_spaces(contacts, scene, made, vertices, half_spaces, twists,
                  [&](const VertexMotion& vertex, const HalfSpaceMotion& half_space, double thickness,
                      const Twist* twist) {
                    const ElementaryOptions elementary = elementary_options(options, thickness);
                    if (twist != nullptr) {
                      return options.keep_distance
                                 ? turning_half_space_keep_distance(vertex, *twist, half_space,
                                                                    keep_of(thickness), elementary, counts)
                             : candidates ? turning_half_space_candidate(vertex, *twist, half_space, elementary,
                                                                         counts)
                                          : turning_half_space_test(vertex, *twist, half_space, elementary,
                                                                    counts);
                    }
                    return options.keep_distance
                               ? half_space_keep_distance(vertex, half_space, keep_of(thickness), 1, counts)
                           : candidates ? half_space_candidate(vertex, half_space, elementary, counts)
                                        : half_space_test(vertex, half_space, elementary, counts);
                  });
  Outcome outcome = answer_of(std::move(contacts), scene, made, options);
  if (max_step) {  // which tells of the first alone
    outcome.vf = outcome.ee = outcome.vh = outcome.possible = 0;
    if (outcome.earliest_toi) {
      std::erase_if(outcome.contacts, [&](const Contact& c) { return c.toi > *outcome.earliest_toi; });
      outcome.contacts.resize(1);
    }
    for (double& toi : outcome.world_tois) toi = std::min(toi, 1.0);
  }
  if (options.fields.any()) describe(outcome, made, vertices, half_spaces, twists);
  return outcome;
}

Outcome AcceptedState::brute_force(const NearOperation& near, const ColliderOptions& of_session) const {
  const Question question = near.question();
  if (const Status valid = validate(question.kind, near.options); !valid) return refusal(valid);
  const ColliderOptions options = merged(of_session, question);
  if (const Status valid = validate(options); !valid) return refusal(valid);
  const Scene made = Scene::create(scene).value();
  if (const Status valid = check_thickness(made.most_thickness(), options); !valid) return refusal(valid);
  const bool at_end = near.where == Where::kTrialEnd;
  const std::vector<VertexMotion> vertices =
      motion_between(positions, at_end ? target_of(*this, *trial) : positions);
  if (near.tangled) {
    Outcome outcome =
        answer_of(meeting_edges_and_faces(scene, made, vertices, options.instant), scene, made, options);
    outcome.earliest_toi.reset();
    return outcome;
  }
  ElementaryCounts counts;
  std::vector<Contact> reported = found_by(
      scene, made, vertices, {}, options.min_separation, [&](const TurningPair& pair, double thickness) {
        return proximity_test(pair.features, options.instant, elementary_options(options, thickness), counts);
      });
  const std::vector<HalfSpaceMotion> half_spaces = half_spaces_of(*this, at_end ? &*trial : nullptr);
  add_half_spaces(reported, scene, made, vertices, half_spaces, {},
                  [&](const VertexMotion& vertex, const HalfSpaceMotion& half_space, double thickness,
                      const Twist* /*none turns at an instant*/) {
                    return half_space_proximity(vertex, half_space, options.instant,
                                                elementary_options(options, thickness), counts);
                  });
  Outcome outcome = answer_of(reported, scene, made, options);
  outcome.earliest_toi.reset();
  if (options.report == Report::kVertexDistances) {
    outcome.vertex_distances.assign(made.vertex_count(), near.distance);
    for (const Contact& pair : reported) {
      if (pair.kind == ContactKind::kVertexHalfSpace) {
        const double distance = half_space_distance(vertices[pair.a], half_spaces[pair.b], options.instant);
        double& least = outcome.vertex_distances[pair.a];
        least = std::min(
            least, beyond_thickness(distance, made.thickness_of(pair.a), scene.bodies[pair.b].thickness));
        continue;
      }
      const FeatureVertices features = features_of(made, vertices, pair.kind, pair.a, pair.b);
      const auto ids = made.vertices_of(pair);
      const std::span<const std::uint32_t> all_ids(ids);
      const std::size_t of_a = vertices_of_first(pair.kind);
      const double bound = beyond_thickness(
          least_distance(features, options.instant, near.distance + thickness_of(made, pair)),
          thickness_of(made, all_ids.first(of_a)), thickness_of(made, all_ids.subspan(of_a)));
      for (const std::uint32_t v : made.vertices_of(pair))
        outcome.vertex_distances[v] = std::min(outcome.vertex_distances[v], bound);
    }
  }
  if (options.reduced) {
    ReducedOracle reduced = reduced_oracle(made, vertices, outcome.contacts);
    outcome.contacts = std::move(reduced.contacts);
    outcome.closest_pairs = std::move(reduced.closest_pairs);
  }
  if (options.fields.any()) describe(outcome, made, vertices, half_spaces, {});
  return outcome;
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
      operation.poses.push_back({b, draw_pose(draws, step, state)});
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
  if (draws.below(3) == 0) options.tier = static_cast<Tier>(draws.below(3));
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
  return {{body, std::move(shape.faces), std::move(shape.edges)}, std::move(shape.positions)};
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
      place.poses.push_back({b, draw_pose(draws, 0.5 * state.unit, state)});
  }
  return place;
}

StepOperation spoiled(Draws& draws, const AcceptedState& state, StepOperation step) {
  const double bad[] = {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()};
  switch (draws.below(6)) {
    case 0:
      if (!step.all) step.all = state.positions;
      (*step.all)[static_cast<std::size_t>(draws.below(static_cast<int>(step.all->size())))] =
          bad[draws.below(2)];
      if (draws.below(2) == 0) return step;  // and perhaps parts besides
      step.bodies.clear();
      step.poses.clear();
      step.vertices.clear();
      step.vertex_positions.clear();
      return step;
    case 1:
      if (!step.all) step.all = state.positions;
      step.all->pop_back();
      return step;
    case 2:
      if (!step.poses.empty()) {
        step.poses.push_back(step.poses.front());  // twice
        return step;
      }
      break;
    case 3:
      if (!step.bodies.empty()) {
        step.bodies.back().positions.back() = bad[draws.below(2)];
        return step;
      }
      break;
    case 4:
      if (!step.poses.empty()) {
        step.poses.back().pose.matrix[0] += 0.5;
        return step;
      }
      break;
    default:
      if (!step.vertices.empty()) {
        step.vertices.back() = state.scene.vertex_count;
        return step;
      }
      break;
  }
  step.vertices.push_back(0);
  step.vertices.push_back(0);
  step.vertex_positions.resize(3 * step.vertices.size(), 0.0);
  return step;
}

}  // namespace warmfront::testing

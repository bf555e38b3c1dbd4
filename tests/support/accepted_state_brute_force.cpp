// SPDX-License-Identifier: Apache-2.0
// Brute force: each question answered by testing every pair of features, one by one.
#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "engine/elementary/candidate.h"
#include "engine/elementary/edge_face.h"
#include "engine/elementary/proximity.h"
#include "engine/elementary/turning.h"
#include "engine/scene/screws.h"
#include "engine/scene/thickness.h"
#include "tests/support/accepted_state.h"
#include "tests/support/accepted_state_parts.h"
#include "tests/support/brute_force.h"
#include "tests/support/max_step_oracle.h"
#include "tests/support/pair_rules.h"
#include "tests/support/reduced_oracle.h"

namespace warmfront::testing {
namespace {

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

// All that `test`, of two features with their twists, their numbers, and how thick both are together, finds
// of the pairs that the scene allows, one by one; in a question with this separation.
template <class Test>
std::vector<Contact> found_by(const SceneDescription& scene, const Scene& made,
                              std::span<const VertexMotion> vertices, const Twists& twists, double separation,
                              Test&& test) {
  std::vector<Contact> contacts;
  const PairRules rules(made, scene.filters);
  for_all_pairs(made, true, [&](ContactKind kind, std::uint32_t a, std::uint32_t b) {
    const auto ids = made.vertices_of({kind, ContactStatus::kHit, a, b, 0});
    if (!may_meet(scene, made.body_of_vertex()[ids[0]], made.body_of_vertex()[ids[3]])) return;
    const Contact pair{kind, ContactStatus::kHit, a, b, 0};
    const double thickness = thickness_of(made, pair);
    const bool of_points = kind == ContactKind::kVertexEdge || kind == ContactKind::kVertexVertex;
    if (of_points && separation + thickness == 0) return;
    const FeatureVertices features = features_of(made, vertices, kind, a, b);
    const Verdict verdict = test(turning_pair(made, twists, features, kind, a, b), pair, thickness);
    const Contact contact{kind, verdict.status, a, b, verdict.toi};
    if (verdict.contact && !rules.leave_out(contact)) contacts.push_back(contact);
  });
  return contacts;
}

// All edges and faces of what may meet that do, and share no vertex.
std::vector<Contact> meeting_edges_and_faces(const SceneDescription& scene, const Scene& made,
                                             std::span<const VertexMotion> vertices, Instant at) {
  std::vector<Contact> meeting;
  std::uint64_t exact_tests = 0;
  const PairRules rules(made, scene.filters);
  for (std::uint32_t e = 0; e < made.edge_count(); ++e) {
    for (std::uint32_t f = 0; f < made.face_count(); ++f) {
      const Edge& edge = made.edges()[e];
      const Face& face = made.faces()[f];
      const auto in_face = [&](std::uint32_t v) { return std::ranges::find(face, v) != face.end(); };
      if (in_face(edge[0]) || in_face(edge[1])) continue;
      if (!may_meet(scene, made.body_of_vertex()[edge[0]], made.body_of_vertex()[face[0]])) continue;
      const EdgeFaceVertices five{&vertices[edge[0]], &vertices[edge[1]], &vertices[face[0]],
                                  &vertices[face[1]], &vertices[face[2]]};
      const double toi = at == Instant::kStart ? 0 : 1;
      const Contact contact{ContactKind::kEdgeFace, ContactStatus::kHit, e, f, toi};
      if (edge_meets_face(five, at, exact_tests) && !rules.leave_out(contact)) meeting.push_back(contact);
    }
  }
  return meeting;
}

// All that `test`, of a vertex, a half-space, how thick both are together, and the vertex's twist, finds,
// after `contacts`.
template <class Test>
void add_half_spaces(std::vector<Contact>& contacts, const SceneDescription& scene, const Scene& made,
                     const Twists& twists, Test&& test) {
  for (std::uint32_t v = 0; v < made.vertex_count(); ++v) {
    for (std::uint32_t b = 0; b < scene.bodies.size(); ++b) {
      if (!scene.bodies[b].half_space || !may_meet(scene, made.body_of_vertex()[v], b)) continue;
      const double thickness = made.thickness_of(v) + scene.bodies[b].thickness;
      const Verdict verdict = test(v, b, thickness, twist_around(twists, made, v));
      if (verdict.contact)
        contacts.push_back({ContactKind::kVertexHalfSpace, verdict.status, v, b, verdict.toi});
    }
  }
}

ElementaryOptions elementary_options(const ColliderOptions& options, double separation) {
  return {.tier = options.tier, .tolerance = options.tolerance, .min_separation = separation};
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
  if (const Status valid = check_screws(screw_count(scene.bodies) > 0, options); !valid)
    return refusal(valid);
  const std::vector<VertexMotion> vertices = motion_between(positions, target_of(*this, step));
  const Twists twists = twists_of(*this, step);
  const bool candidates = options.report == Report::kCandidates;
  ElementaryCounts counts;
  const auto keep_of = [&](double m) { return KeepDistance{options.keep_distance.value_or(0), m}; };
  const std::vector<PosedRounding> posed = posed_by(*this, step);
  const auto posed_around = [&](std::uint32_t v) {  // where none is declared, bodies are found
    return posed.empty() ? PosedRounding() : posed[made.body_of_vertex()[v]];
  };
  // By vertex of the pair.
  const auto posed_of = [&](const Contact& pair) {
    std::array<PosedRounding, 4> of_vertices;
    const auto ids = made.vertices_of(pair);
    for (std::size_t k = 0; k < 4; ++k) of_vertices[k] = posed_around(ids[k]);
    return of_vertices;
  };
  const double tolerance =
      options.keep_distance && options.tier == Tier::kExact ? 0x1p-32 : options.tolerance;
  const CertifiedOptions kept{.tolerance = tolerance};
  const bool leaves_room = max_step && options.tier != Tier::kFast;
  const bool filtered = !leaves_room && options.min_separation == 0 && made.most_thickness() == 0;
  const auto elementary = [&](const FeatureVertices& features, double separation) {
    const Verdict verdict = elementary_test(features, elementary_options(options, separation), counts);
    return verdict.contact && filtered && left_out_by_filter(features) ? Verdict() : verdict;
  };
  const auto test = [&](const TurningPair& pair, double separation) {
    if (pair.first != nullptr || pair.second != nullptr) {
      return options.keep_distance ? turning_keep_distance_test(pair, keep_of(separation), kept)
             : candidates          ? turning_candidate_test(pair, separation)
                          : turning_test(pair, {.tolerance = tolerance, .min_separation = separation});
    }
    return options.keep_distance ? keep_distance_test(pair.features, keep_of(separation), kept)
           : candidates          ? candidate_test(pair.features, separation)
                                 : elementary(pair.features, separation);
  };
  std::vector<Contact> contacts = found_by(
      scene, made, vertices, twists, options.keep_distance ? 1 : options.min_separation,
      [&](const TurningPair& pair, const Contact& ids, double thickness) {
        const double asked = options.min_separation + thickness;
        if (!leaves_room) return test(pair, asked);
        const std::array<PosedRounding, 4> of_vertices = posed_of(ids);
        const bool by_itself =
            std::ranges::all_of(of_vertices, [](const PosedRounding& of) { return of.share == 0; }) &&
            std::ranges::all_of(pair.features.vertex,
                                [&](const VertexMotion* of) { return rounds_to_its_kind(*of, rounding); });

        RoomOracle in_room =
            lines_in_room(pair.features, room_of(pair.features, rounding, of_vertices), by_itself, asked,
                          [&](double separation) { return test(pair, separation); });
        if (pair.first != nullptr || pair.second != nullptr) {
          in_room.keeps_its_side = false;
          in_room.start.arcs = turning_slack(pair);
          in_room.comes_within = [&pair](double within) { return turning_comes_within(pair, within); };
        }
        return with_room(asked, options.leave_out_overlaps, in_room);
      });
  const std::vector<HalfSpaceMotion> half_spaces = half_spaces_of(*this, &step);
  add_half_spaces(
      contacts, scene, made, twists,
      [&](std::uint32_t v, std::uint32_t b, double thickness, const Twist* twist) {
        const VertexMotion& vertex = vertices[v];
        const HalfSpaceMotion& half_space = half_spaces[b];
        const auto plain = [&](double separation, const ElementaryOptions& elementary) {
          ElementaryOptions with = elementary;
          with.min_separation = separation;
          return twist != nullptr ? turning_half_space_test(vertex, *twist, half_space, with, counts)
                                  : half_space_test(vertex, half_space, with, counts);
        };
        const auto test_by = [&](double separation) {
          const ElementaryOptions elementary = elementary_options(options, separation);
          if (options.keep_distance) {
            return twist != nullptr
                       ? turning_half_space_keep_distance(vertex, *twist, half_space, keep_of(separation),
                                                          elementary, counts)
                       : half_space_keep_distance(vertex, half_space, keep_of(separation), 1, counts);
          }
          if (!candidates) return plain(separation, elementary);
          return twist != nullptr
                     ? turning_half_space_candidate(vertex, *twist, half_space, elementary, counts)
                     : half_space_candidate(vertex, half_space, elementary, counts);
        };
        const double asked = options.min_separation + thickness;
        if (!leaves_room) return test_by(asked);
        RoomOracle in_room;
        in_room.size = pair_size(vertex, half_space);
        in_room.rounding = room_of(vertex, half_space, rounding, posed_around(v), posed[b]);
        if (half_space.moves()) in_room.rounding = std::max(in_room.rounding, 0x1p-1074);
        in_room.start = start_gap(vertex, half_space);
        if (twist != nullptr) in_room.start.arcs = turning_half_space_slack(vertex, *twist, half_space);
        in_room.keeps_its_side = posed_around(v).share == 0 && posed[b].share == 0 &&
                                 rounds_to_its_kind(vertex, rounding) && keeps_its_side(vertex, half_space);
        in_room.test = test_by;
        in_room.starts_within = [&](double within) {
          return starts_within(vertex, half_space, within, counts);
        };
        in_room.comes_within = [&](double within) {
          if (twist != nullptr)
            return turning_half_space_comes_within(vertex, *twist, half_space, within, counts);
          return comes_within(vertex, half_space, within, counts);
        };
        return with_room(asked, options.leave_out_overlaps, in_room);
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
  std::vector<Contact> reported =
      found_by(scene, made, vertices, {}, options.min_separation,
               [&](const TurningPair& pair, const Contact& /*ids*/, double thickness) {
                 const double separation = options.min_separation + thickness;
                 return proximity_test(pair.features, options.instant,
                                       elementary_options(options, separation), counts);
               });
  const std::vector<HalfSpaceMotion> half_spaces = half_spaces_of(*this, at_end ? &*trial : nullptr);
  add_half_spaces(
      reported, scene, made, {},
      [&](std::uint32_t v, std::uint32_t b, double thickness, const Twist* /*none turns at an instant*/) {
        return half_space_proximity(vertices[v], half_spaces[b], options.instant,
                                    elementary_options(options, options.min_separation + thickness), counts);
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

}  // namespace warmfront::testing

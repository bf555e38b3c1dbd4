// SPDX-License-Identifier: Apache-2.0
// What of all contacts a question is told.
#include <algorithm>
#include <array>
#include <cstddef>
#include <limits>
#include <map>
#include <utility>

#include "engine/elementary/contact_geometry.h"
#include "engine/elementary/turning.h"
#include "tests/support/accepted_state_parts.h"

namespace warmfront::testing {
namespace {

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

}  // namespace

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

}  // namespace warmfront::testing

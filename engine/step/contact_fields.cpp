// SPDX-License-Identifier: Apache-2.0
#include "engine/step/contact_fields.h"

#include <array>
#include <vector>

#include "engine/elementary/contact_geometry.h"
#include "engine/elementary/turning.h"
#include "engine/parallel/stoppable_loops.h"
#include "engine/step/half_space_stage.h"

namespace warmfront {
namespace {

// A vertex on an arc as one that rests where it is then; any other one as it moves.
VertexMotion at_toi(const Core& core, std::uint32_t v, const VertexMotion& vertex, double toi) {
  const Twist* twist = core.options.pair_test == PairTest::kMotion ? core.arcs.around(v) : nullptr;
  if (twist == nullptr) return vertex;
  const auto then = on_arc(vertex, *twist, toi);
  return {then, then};
}

}  // namespace

void compute_contact_fields(Core& core, StopSignal stop) {
  FoundPairs& found = core.found();
  const std::span<const Contact> contacts = found.contacts;
  std::vector<ContactGeometry>& geometry = found.geometry;
  geometry.clear();
  if (!core.options.fields.any()) return;
  lengthen(geometry, contacts.size(), ContactGeometry{}, stop);
  const std::span<const VertexMotion> vertices = core.motion.vertices().vertices();
  const Renumbering& numbering = core.topology->numbering;
  for_each_index(0, contacts.size(), stop, [&](std::size_t i) {
    const Contact& contact = contacts[i];
    if (contact.kind == ContactKind::kVertexHalfSpace) {
      const std::uint32_t v = number_of(numbering.renumbered(GivenVertex{contact.a}));
      const VertexMotion vertex = at_toi(core, v, vertex_now(core, v), contact.toi);
      geometry[i] = half_space_geometry(vertex, half_space_now(core, contact.b), contact.toi);
      return;
    }
    std::array<VertexMotion, 4> moving;
    std::array<const VertexMotion*, 4> four;
    const auto ids = core.scene->vertices_of(contact);
    for (int k = 0; k < 4; ++k) {
      const std::uint32_t v = number_of(numbering.renumbered(GivenVertex{ids[k]}));
      four[k] = &vertices[v];
      if (core.arcs.around(v) == nullptr) continue;
      moving[k] = at_toi(core, v, vertices[v], contact.toi);
      four[k] = &moving[k];
    }
    geometry[i] = contact_geometry(contact.kind, four, contact.toi);
  });
}

}  // namespace warmfront

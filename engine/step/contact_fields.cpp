// SPDX-License-Identifier: Apache-2.0
#include "engine/step/contact_fields.h"

#include <array>
#include <vector>

#include "engine/elementary/contact_geometry.h"
#include "engine/parallel/stoppable_loops.h"
#include "engine/step/half_space_stage.h"

namespace warmfront {

void compute_contact_fields(Core& core, StopSignal stop) {
  FoundPairs& found = core.found();
  const std::vector<Contact>& contacts = found.contacts;
  std::vector<ContactGeometry>& geometry = found.geometry;
  geometry.clear();
  if (!core.options.fields.any()) return;
  geometry.resize(contacts.size());
  const std::span<const VertexMotion> vertices = core.motion.vertices().vertices();
  const Renumbering& numbering = core.topology->numbering;
  for_each_index(0, contacts.size(), stop, [&](std::size_t i) {
    const Contact& contact = contacts[i];
    if (contact.kind == ContactKind::kVertexHalfSpace) {
      const std::uint32_t v = number_of(numbering.renumbered(GivenVertex{contact.a}));
      geometry[i] = half_space_geometry(vertex_now(core, v), half_space_now(core, contact.b), contact.toi);
      return;
    }
    std::array<const VertexMotion*, 4> four;
    const auto ids = core.scene->vertices_of(contact);
    for (int k = 0; k < 4; ++k) four[k] = &vertices[number_of(numbering.renumbered(GivenVertex{ids[k]}))];
    geometry[i] = contact_geometry(contact.kind, four, contact.toi);
  });
}

}  // namespace warmfront

// SPDX-License-Identifier: Apache-2.0
// Which world a contact is in. Pure function.
#pragma once

#include <cstdint>

#include "engine/contact.h"
#include "engine/scene.h"
#include "engine/scene/renumbering.h"
#include "engine/scene/scene_edges.h"
#include "engine/scene/worlds.h"

namespace warmfront {

/// Its place among `worlds`. The contact is in given numbers, the scene in new ones: bodies keep their ranges
/// of vertices, and edges their numbers. Not of kind edge-face.
inline std::uint32_t world_of(const Contact& contact, const Scene& scene, const Renumbering& numbering,
                              const Worlds& worlds) {
  if (!worlds.any()) return 0;
  const std::span<const std::uint32_t> bodies = scene.body_of_vertex();
  const auto of_edge = [&](EdgeId edge) { return bodies[ends_of(scene, edge)[0]]; };
  using enum ContactKind;
  switch (contact.kind) {
    case kEdgeEdge:
      return worlds.place(of_edge(EdgeId{contact.a}), of_edge(EdgeId{contact.b}));
    case kVertexEdge:
      return worlds.place(bodies[contact.a], of_edge(EdgeId{contact.b}));
    case kVertexHalfSpace:
      return worlds.place(bodies[contact.a], contact.b);
    case kVertexVertex:
      return worlds.place(bodies[contact.a], bodies[contact.b]);
    default: {
      const std::uint32_t face = number_of(numbering.renumbered(GivenFace{contact.b}));
      return worlds.place(bodies[contact.a], bodies[scene.faces()[face][0]]);
    }
  }
}

}  // namespace warmfront

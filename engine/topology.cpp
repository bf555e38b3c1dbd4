// SPDX-License-Identifier: Apache-2.0
#include "engine/topology.h"

#include <utility>

#include "engine/scene/adjacency.h"

namespace warmfront {
namespace {

/// Rings of faces in a patch whose self-collision the normal cone can rule out: few enough to be flat often,
/// enough that most near pairs of faces lie in one patch.
constexpr int kPatchRings = 3;

// Found in the numbers first given, so that they are the same whatever the first positions.
Patches patches_of(const Scene& given, bool cones) {
  Patches patches = cones ? find_patches(given, kPatchRings) : Patches{};
  patches.of_face.resize(given.face_count(), Patches::kNone);
  return patches;
}

}  // namespace

Topology::Topology(const Scene& given, const Motion& motion, const TreeShape& shape, bool cones)
    : given_order_(build_order(given, motion, shape)),
      numbering(given, given_order_),
      first_order(numbering.apply(given, std::exchange(given_order_, {}))),
      scene(numbering.apply(given)),
      patches(numbering.apply(patches_of(given, cones))),
      ownership(scene),
      orphans(enumerate_orphans(scene)),
      adjacent_pairs(count_adjacent_pairs(scene)) {}

std::size_t Topology::memory_bytes() const {
  return numbering.memory_bytes() + first_order.size() * sizeof(std::uint32_t) + scene.memory_bytes() +
         patches.memory_bytes() + ownership.memory_bytes() +
         (orphans.vertex_face.size() + orphans.edge_edge.size()) * sizeof(FeatureIds);
}

}  // namespace warmfront

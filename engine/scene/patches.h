// SPDX-License-Identifier: Apache-2.0
// Patches: connected sets of faces on which the normal cone theorem can hold. Found once per topology;
// immutable.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "engine/scene.h"
#include "engine/scene/held_bytes.h"
#include "engine/scene/scene_join.h"
#include "engine/stop.h"

namespace warmfront {

/// A patch is a set of faces that is connected through edges, manifold and consistently oriented there, and
/// bounded by one closed contour (reference/algorithms 2.2). It depends on the topology only, so that the
/// cone test excludes the same pairs for every hierarchy.
struct Patches {
  static constexpr std::uint32_t kNone = 0xffffffff;

  std::vector<std::uint32_t> of_face;  ///< patch of each face, or kNone
  Csr faces;                           ///< faces of each patch
  Csr contours;                        ///< vertices along each patch's contour, in the faces' orientation

  std::size_t count() const { return faces.rows(); }
  std::size_t memory_bytes() const {
    return held_bytes(of_face) + faces.memory_bytes() + contours.memory_bytes();
  }
};

/// Takes the faces within `rings` rings around each vertex, lowest first, where none of them is taken yet;
/// then with one ring less, down to two (one ring has no non-adjacent faces). Full rings have a round
/// contour, which the contour test can prove; pieces that are not manifold, oriented and bounded by one
/// contour are in no patch. O(m) for bounded degree. Throws Stopped when told to stop.
Patches find_patches(const Scene& scene, int rings, StopSignal stop = {});

/// Patches of faces that become the next ones of another scene; each lies within one slice.
struct PatchesSlice {
  const Patches* patches = nullptr;
  std::uint32_t first_face = 0;
  std::uint32_t end_face = 0;
  NumberShift shift;
};
/// Those of a scene that was put together of these. Throws Stopped when told to stop.
Patches join_patches(std::span<const PatchesSlice> slices, StopSignal stop);

}  // namespace warmfront

// SPDX-License-Identifier: Apache-2.0
// Patches: pieces of surface on which the normal cone theorem can hold. Found once per topology; immutable.
#pragma once

#include <cstdint>
#include <vector>

#include "engine/scene/scene.h"

namespace warmfront {

/// A patch is a set of faces that is connected through edges, manifold and consistently oriented there, and
/// bounded by one closed contour (reference/algorithms 2.2). It depends on the topology alone, so that what
/// the cone test leaves out is the same whatever the hierarchy.
struct Patches {
  static constexpr std::uint32_t kNone = 0xffffffff;

  std::vector<std::uint32_t> of_face;  ///< patch of each face, or kNone
  Csr faces;                           ///< faces of each patch
  Csr contours;                        ///< vertices along each patch's contour, in the faces' orientation

  std::size_t count() const { return faces.rows(); }
  std::size_t memory_bytes() const {
    return of_face.size() * sizeof(std::uint32_t) + faces.memory_bytes() + contours.memory_bytes();
  }
};

/// Grows patches of up to `max_faces` faces breadth first from the lowest face not yet taken. Pieces that
/// have no single contour, or fewer than 4 faces (they have no non-adjacent pairs to speak of), are in no
/// patch. O(m).
Patches find_patches(const Scene& scene, std::uint32_t max_faces);

}  // namespace warmfront

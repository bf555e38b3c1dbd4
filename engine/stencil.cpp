// SPDX-License-Identifier: Apache-2.0
#include "engine/stencil.h"

#include <algorithm>

namespace warmfront {

Stencil stencil_of(ContactKind kind, const std::array<std::uint32_t, 4>& vertices, std::uint8_t stencil) {
  Stencil made;
  for (int k = 0; k < 4; ++k)
    if ((stencil >> k & 1) != 0) made.vertices[made.size++] = vertices[k];
  if (kind == ContactKind::kVertexHalfSpace) {
    made.kind = ClosestFeatures::kFaceVertex;
    return made;
  }
  const bool faces = kind == ContactKind::kVertexFace;
  // The vertex goes behind the edge or face that is listed after it.
  const bool vertex_first = made.size > 2 && (faces || (made.size == 3 && (stencil & 0b1100) == 0b1100));
  if (vertex_first)
    std::rotate(made.vertices.begin(), made.vertices.begin() + 1, made.vertices.begin() + made.size);
  made.kind = made.size == 2   ? ClosestFeatures::kVertexVertex
              : made.size == 3 ? ClosestFeatures::kEdgeVertex
              : faces          ? ClosestFeatures::kFaceVertex
                               : ClosestFeatures::kEdgeEdge;
  return made;
}

}  // namespace warmfront

// SPDX-License-Identifier: Apache-2.0
// The vertices of a closest pair, as those who assemble barriers or forces need them: the same of the
// engine's rows and of a client's columns. Pure function.
#pragma once

#include <array>
#include <cstdint>

#include "engine/contact.h"

namespace warmfront {

/// The closest features of a row of a reduced answer. Vertices in the order of the letters: of VV two, as the
/// row has them; of EV the edge's two, then the vertex; of EE edge a's two, then edge b's; of FV the face's
/// three, then the vertex. Of a half-space FV of size 1: the vertex alone. What is beyond `size` is 0. It
/// does not tell how thick its row is: that is the thickest vertex of the row's faces or edges. Where
/// thickness differs between the vertices of one body, sum barriers from rows that are not reduced.
struct Stencil {
  ClosestFeatures kind = ClosestFeatures::kVertexVertex;
  std::uint8_t size = 0;  ///< 2, 3 or 4; of a half-space 1
  std::array<std::uint32_t, 4> vertices{};

  friend bool operator==(const Stencil&, const Stencil&) = default;
};

/// `vertices` as Scene::vertices_of() or the columns of a client tell them; `stencil` as ClosestPair has it.
Stencil stencil_of(ContactKind kind, const std::array<std::uint32_t, 4>& vertices, std::uint8_t stencil);

}  // namespace warmfront

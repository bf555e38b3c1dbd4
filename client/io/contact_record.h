// SPDX-License-Identifier: Apache-2.0
// A contact for users: by its four vertices instead of the engine's ids, so that it means the same
// in-process, over the wire and in a file. Plain values.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "engine/contact.h"

namespace warmfront::client {

/// Was the row there in the frame before? An ended one was, and is not any more: nothing but its features
/// holds.
enum class RowContinuity : std::uint8_t { kNew = 0, kKept = 1, kEnded = 2 };

/// `vertices`: as Scene::vertices_of(). The vertex, then the face's three (vertex-face); edge a's two, then
/// edge b's two (edge-edge); the vertex three times, then the number of the body (vertex-half-space).
struct ContactRecord {
  ContactKind kind = ContactKind::kVertexFace;
  ContactStatus status = ContactStatus::kHit;
  std::array<std::uint32_t, 4> vertices{};
  double toi = 0;                 ///< in [0, 1]
  ClosestPair closest_pair = {};  ///< of a reduced answer
  RowContinuity continuity = RowContinuity::kNew;

  /// How many of `vertices` are vertices.
  std::size_t vertex_count() const { return kind == ContactKind::kVertexHalfSpace ? 3 : 4; }

  friend bool operator==(const ContactRecord&, const ContactRecord&) = default;
};

}  // namespace warmfront::client

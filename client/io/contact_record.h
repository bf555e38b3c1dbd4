// SPDX-License-Identifier: Apache-2.0
// A contact for users: by its four vertices instead of the engine's ids, so that it means the same
// in-process, over the wire and in a file. Plain values.
#pragma once

#include <array>
#include <cstdint>

#include "engine/contact.h"

namespace warmfront::client {

/// `vertices`: the vertex, then the face's three (vertex-face); edge a's two, then edge b's two (edge-edge).
struct ContactRecord {
  ContactKind kind = ContactKind::kVertexFace;
  ContactStatus status = ContactStatus::kHit;
  std::array<std::uint32_t, 4> vertices{};
  double toi = 0;  ///< in [0, 1]

  friend bool operator==(const ContactRecord&, const ContactRecord&) = default;
};

}  // namespace warmfront::client

// SPDX-License-Identifier: Apache-2.0
// Reads the known answers to one step: `type,v0,v1,v2,v3,collides`, a line a pair. Pure functions; they trust
// nothing in a file.
#pragma once

#include <array>
#include <compare>
#include <cstdint>
#include <string_view>
#include <vector>

#include "engine/contact.h"
#include "engine/result.h"

namespace warmfront::client {

/// A feature pair by its vertices in canonical order: a vertex and the face's three, ascending; or two edges,
/// the ends of each ascending, the lower edge first.
struct PairKey {
  ContactKind kind = ContactKind::kVertexFace;
  std::array<std::uint32_t, 4> vertices{};

  static PairKey of(ContactKind kind, std::array<std::uint32_t, 4> vertices);
  friend auto operator<=>(const PairKey&, const PairKey&) = default;
};

struct KnownPairs {
  std::vector<PairKey> touching;  ///< sorted, each once
  std::vector<PairKey> apart;     ///< likewise
};

/// A header line, then `vf` (vertex, then the face's three) or `ee` (an edge's two, then the other's), four
/// vertices below `vertex_count`, and 1 where the pair touches during the step, 0 where it does not. Anything
/// else is an error that names the line; so is a pair with both answers.
Result<KnownPairs> parse_known_pairs(std::string_view text, std::string_view name,
                                     std::uint32_t vertex_count);

}  // namespace warmfront::client

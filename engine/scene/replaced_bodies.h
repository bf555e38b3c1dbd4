// SPDX-License-Identifier: Apache-2.0
// What changes of a scene made of its bodies. Plain values.
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

#include "engine/scene.h"
#include "engine/scene/local_change.h"

namespace warmfront {

struct ReplacedBodies {
  static constexpr std::size_t kNoChange = std::numeric_limits<std::size_t>::max();

  /// A body that is not as it was.
  struct Piece {
    std::uint32_t body = 0;
    Scene alone;  ///< the body as a scene of its own
    /// The change that has its positions; kNoChange: it keeps its vertices, and has other elements.
    std::size_t positions_of = kNoChange;
    /// Where it keeps its vertices and has changed locally: what is left of what it was, as given.
    std::optional<LocalChange> change = std::nullopt;

    bool keeps_vertices() const { return positions_of == kNoChange; }
  };

  /// By body, those that were added included; empty unless some change replaces something.
  std::vector<Piece> pieces;
  /// Of the scene before, by given number of a face: its number when faces are ordered by body; empty where
  /// that is the same.
  std::vector<std::uint32_t> face_rank;
  /// The scene declares no bodies and is another one as a whole.
  bool whole_scene = false;

  bool any() const { return whole_scene || !pieces.empty(); }
};

}  // namespace warmfront

// SPDX-License-Identifier: Apache-2.0
// What follows from a list of faces: edges, incidence, components. Pure functions; all throw Stopped when
// told to stop.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "engine/scene.h"
#include "engine/stop.h"

namespace warmfront {

/// For each key, in [0, rows), the lists that contain it, each once and ascending.
Csr invert(std::span<const std::array<std::uint32_t, 3>> lists, std::size_t rows, StopSignal stop);

struct EdgeTable {
  std::vector<Edge> edges;                               ///< sorted; each once, its lesser vertex first
  std::vector<std::array<std::uint32_t, 3>> face_edges;  ///< by face; side k runs from vertex k to k + 1
};
EdgeTable find_edges(std::span<const Face> faces, StopSignal stop);

/// The connected component of each vertex; a vertex of no face is a component of its own. Numbered by their
/// least vertex, `count` in all.
std::vector<std::uint32_t> connected_components(std::span<const Face> faces, std::uint32_t vertex_count,
                                                std::uint32_t& count, StopSignal stop);

}  // namespace warmfront

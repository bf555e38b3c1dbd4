// SPDX-License-Identifier: Apache-2.0
// What follows from lists of faces and edges: incidence, components. Pure functions; all throw Stopped when
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

using GivenEdge = std::array<std::int32_t, 2>;

/// For each key, in [0, rows), the lists that contain it, each once and ascending.
Csr invert(std::span<const std::array<std::uint32_t, 3>> lists, std::size_t rows, StopSignal stop);

struct EdgeTable {
  std::vector<Edge> edges;                               ///< sorted; each once, its lesser vertex first
  std::vector<std::array<std::uint32_t, 3>> face_edges;  ///< by face; side k runs from vertex k to k + 1
  std::vector<std::uint32_t> lone_edges;                 ///< of no face, ascending
};
/// Of the faces' sides and the edges given besides.
EdgeTable find_edges(std::span<const Face> faces, std::span<const GivenEdge> more, StopSignal stop);
/// For each vertex the lone edges around it, ascending; without rows where there are none.
Csr lone_edges_of_vertices(std::span<const Edge> edges, std::span<const std::uint32_t> lone_edges,
                           std::uint32_t vertex_count, StopSignal stop);

/// The connected component of each vertex; one of no face and no edge is a component of its own. Numbered by
/// their least vertex, `count` in all.
std::vector<std::uint32_t> connected_components(std::span<const Face> faces, std::span<const Edge> edges,
                                                std::span<const std::uint32_t> lone_edges,
                                                std::uint32_t vertex_count, std::uint32_t& count,
                                                StopSignal stop);

}  // namespace warmfront

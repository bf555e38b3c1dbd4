// SPDX-License-Identifier: Apache-2.0
// Face adjacency. Two faces are adjacent when they share a vertex. Pure functions.
#pragma once

#include <cstdint>
#include <span>

#include "engine/scene.h"
#include "engine/scene/scene_edges.h"
#include "engine/stop.h"

namespace warmfront {

inline bool has_vertex(const Face& face, std::uint32_t v) {
  return face[0] == v || face[1] == v || face[2] == v;
}

inline bool has_end(const Edge& edge, std::uint32_t v) {
  return edge[0] == v || edge[1] == v;
}

/// True when the edge and the face share a vertex.
inline bool adjacent(const Edge& e, const Face& f) {
  return has_vertex(f, e[0]) || has_vertex(f, e[1]);
}

/// True when the faces share a vertex (a face is adjacent to itself).
inline bool adjacent(const Face& f, const Face& g) {
  return has_vertex(g, f[0]) || has_vertex(g, f[1]) || has_vertex(g, f[2]);
}

inline bool share_vertex(const Edge& a, const Edge& b) {
  return a[0] == b[0] || a[0] == b[1] || a[1] == b[0] || a[1] == b[1];
}

/// True when the face repeats an index: it is a segment or a point.
inline bool repeats_vertex(const Face& face) {
  return face[0] == face[1] || face[1] == face[2] || face[2] == face[0];
}

/// Number of adjacent pairs of faces in a range that is closed under faces. O(m log m). Throws Stopped when
/// told to stop.
std::uint64_t count_adjacent_pairs(const Scene& scene, const FeatureRange& range, StopSignal stop = {});
/// What such a count counts at these vertices and edges: where faces with all their vertices and sides among
/// these are others, the difference of two is that of the counts.
std::uint64_t count_adjacent_pairs_at(const Scene& scene, std::span<const std::uint32_t> vertices,
                                      std::span<const EdgeId> edges, StopSignal stop = {});
inline std::uint64_t count_adjacent_pairs(const Scene& scene) {
  return count_adjacent_pairs(scene, whole(scene));
}

}  // namespace warmfront

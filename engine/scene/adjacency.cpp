// SPDX-License-Identifier: Apache-2.0
#include "engine/scene/adjacency.h"

namespace warmfront {

// Counted at vertices, a pair that shares one is counted once, a pair that shares two (and then the edge
// between them) twice, and a pair of duplicates three times, with three edges. Edges are those between two
// vertices, and duplicates faces of three: (a, a, b) and (a, b, c) share two vertices and one edge.
std::uint64_t count_adjacent_pairs(const Scene& scene, const FeatureRange& range) {
  const auto pairs = [](std::uint64_t n) { return n * (n - 1) / 2; };
  std::uint64_t at_vertices = 0;
  for (std::uint32_t v = range.first_vertex; v < range.end_vertex; ++v) {
    if (const std::uint64_t n = scene.vertex_faces()[v].size(); n > 0) at_vertices += pairs(n);
  }
  std::uint64_t at_edges = 0;
  std::uint64_t duplicates_at_edges = 0;
  for (std::uint32_t e = range.first_edge; e < range.end_edge; ++e) {
    if (scene.edges()[e][0] == scene.edges()[e][1]) continue;
    const auto faces = scene.edge_faces()[e];
    at_edges += pairs(faces.size());
    for (std::size_t i = 0; i < faces.size(); ++i) {
      const Face& face = scene.faces()[faces[i]];
      if (repeats_vertex(face)) continue;
      for (std::size_t j = 0; j < i; ++j) {
        const Face& other = scene.faces()[faces[j]];
        duplicates_at_edges +=
            has_vertex(other, face[0]) && has_vertex(other, face[1]) && has_vertex(other, face[2]);
      }
    }
  }
  return at_vertices - at_edges + duplicates_at_edges / 3;
}

}  // namespace warmfront

// SPDX-License-Identifier: Apache-2.0
#include "engine/scene/adjacency.h"

#include <algorithm>
#include <vector>

namespace warmfront {
namespace {

std::uint64_t pairs_of(std::uint64_t n) {
  return n < 2 ? 0 : n * (n - 1) / 2;
}

// The vertex of a face that is not on the edge.
std::uint32_t third_vertex(const Face& face, const Edge& edge) {
  const auto third =
      std::ranges::find_if(face, [&](std::uint32_t v) { return v != edge[0] && v != edge[1]; });
  return *third;
}

// Counting pairs at vertices counts a pair that shares one vertex once, a pair that shares two (and then the
// edge between them) twice, and a pair of duplicates three times, with three edges. Edges join two distinct
// vertices, and duplicates are faces of three: (a, a, b) and (a, b, c) share two vertices and one edge. Along
// an edge, duplicates are the faces with the same third vertex.
template <class ForVertices, class ForEdges>
std::uint64_t count_pairs(const Scene& scene, StopSignal stop, ForVertices&& for_vertices,
                          ForEdges&& for_edges) {
  PacedStop paced(stop);
  std::uint64_t at_vertices = 0;
  for_vertices([&](std::uint32_t v) {
    paced.check();
    at_vertices += pairs_of(scene.vertex_faces()[v].size());
  });
  std::uint64_t at_edges = 0;
  std::uint64_t duplicates_at_edges = 0;
  std::vector<std::uint32_t> thirds;
  for_edges([&](EdgeId e) {
    paced.check();
    const Edge& edge = ends_of(scene, e);
    const auto faces = faces_along(scene, e);
    if (edge[0] == edge[1] || faces.size() < 2) return;
    at_edges += pairs_of(faces.size());
    thirds.clear();
    for (const std::uint32_t f : faces) {
      paced.check();
      if (!repeats_vertex(scene.faces()[f])) thirds.push_back(third_vertex(scene.faces()[f], edge));
    }
    std::ranges::sort(thirds);
    for (auto first = thirds.begin(); first != thirds.end();) {
      const auto next = std::find_if(first, thirds.end(), [&](std::uint32_t v) { return v != *first; });
      duplicates_at_edges += pairs_of(static_cast<std::uint64_t>(next - first));
      first = next;
    }
  });
  return at_vertices - at_edges + duplicates_at_edges / 3;
}

}  // namespace

std::uint64_t count_adjacent_pairs(const Scene& scene, const FeatureRange& range, StopSignal stop) {
  return count_pairs(
      scene, stop,
      [&](auto&& count) {
        for (std::uint32_t v = range.first_vertex; v < range.end_vertex; ++v) count(v);
      },
      [&](auto&& count) {
        for (EdgeId e = range.first_edge; e < range.end_edge; ++e) count(e);
      });
}

// All that is counted of faces that change is counted there. Three edges count each pair of duplicates that
// changes, so both counts of these leave the same remainder.
std::uint64_t count_adjacent_pairs_at(const Scene& scene, std::span<const std::uint32_t> vertices,
                                      std::span<const EdgeId> edges, StopSignal stop) {
  const auto all = [](const auto& list) {
    return [&list](auto&& count) {
      for (const auto one : list) count(one);
    };
  };
  return count_pairs(scene, stop, all(vertices), all(edges));
}

}  // namespace warmfront

// SPDX-License-Identifier: Apache-2.0
#include "engine/scene/scene_edges.h"

#include <algorithm>

namespace warmfront {

FeatureRange features_of(const Scene& scene, std::uint32_t first_vertex, std::uint32_t end_vertex) {
  // Edges are sorted by their vertices in given numbers, and bodies are ranges of these.
  const auto edges_before = [&](std::uint32_t vertex) {
    return EdgeId{static_cast<std::uint32_t>(
        std::ranges::partition_point(scene.edges(), [&](const Edge& e) { return e[0] < vertex; }) -
        scene.edges().begin())};
  };
  return {first_vertex, end_vertex, edges_before(first_vertex), edges_before(end_vertex)};
}

}  // namespace warmfront

// SPDX-License-Identifier: Apache-2.0
// The model in a few numbers: see model_summary.h.
#include "client/cli/frames/model_summary.h"

#include <algorithm>
#include <nlohmann/json.hpp>

namespace warmfront::client {

ModelSummary summary_of(const SceneDescription& scene) {
  const PairFilters& filters = scene.filters;
  const double of_vertices = scene.thickness.empty() ? 0 : *std::ranges::max_element(scene.thickness);
  return {{.within_edges = filters.within_edges,
           .near_at_rest = filters.near_at_rest,
           .excluded_vertex_pairs = static_cast<std::uint32_t>(filters.excluded_vertex_pairs.size()),
           .patches = !filters.patches.empty()},
          most_thickness(scene.bodies) + of_vertices};
}

ModelSummary summary_of(const SessionInfo& info) {
  return {info.filters, info.most_thickness};
}

bool has_half_spaces(const SceneDescription& scene) {
  return std::ranges::any_of(scene.bodies, [](const Body& body) { return body.half_space.has_value(); });
}

void add_to(nlohmann::ordered_json& report, const ModelSummary& summary) {
  const SessionInfo::Filters& filters = summary.filters;
  report["filters"] = {{"within_edges", filters.within_edges},
                       {"near_at_rest", filters.near_at_rest},
                       {"excluded_vertex_pairs", filters.excluded_vertex_pairs},
                       {"patches", filters.patches}};
  report["most_thickness"] = summary.most_thickness;
}

}  // namespace warmfront::client

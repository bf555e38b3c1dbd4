// SPDX-License-Identifier: Apache-2.0
// The model in a few numbers: see model_summary.h.
#include "client/cli/model_summary.h"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <span>

namespace warmfront::client {
namespace {

double most_thickness(const SceneDescription& scene) {
  const auto thickest = [](std::span<const double> values) {
    return values.empty() ? 0.0 : *std::ranges::max_element(values);
  };
  const std::span<const double> of_vertices = scene.thickness;
  double most = scene.bodies.empty() ? thickest(of_vertices) : 0;
  for (const Body& body : scene.bodies) {
    const double within =
        of_vertices.empty() ? 0 : thickest(of_vertices.subspan(body.first_vertex, body.vertex_count));
    most = std::max(most, body.thickness + within);
  }
  return most;
}

}  // namespace

ModelSummary summary_of(const SceneDescription& scene) {
  const PairFilters& filters = scene.filters;
  return {{.within_edges = filters.within_edges,
           .near_at_rest = filters.near_at_rest,
           .excluded_vertex_pairs = static_cast<std::uint32_t>(filters.excluded_vertex_pairs.size()),
           .patches = !filters.patches.empty()},
          most_thickness(scene)};
}

ModelSummary summary_of(const SessionInfo& info) {
  return {info.filters, info.most_thickness};
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

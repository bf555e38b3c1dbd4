// SPDX-License-Identifier: Apache-2.0
// What a scene's model leaves out and adds, in a few numbers, with the same names in every JSON report. Plain
// values and pure functions.
#pragma once

#include <nlohmann/json_fwd.hpp>

#include "client/lib/answer.h"
#include "engine/scene.h"

namespace warmfront::client {

struct ModelSummary {
  SessionInfo::Filters filters;
  double most_thickness = 0;  ///< no vertex is thicker; 0 where nothing is
};

/// Of a scene that Scene::create() takes.
ModelSummary summary_of(const SceneDescription& scene);
ModelSummary summary_of(const SessionInfo& info);

/// Are any of its bodies half-spaces?
bool has_half_spaces(const SceneDescription& scene);

/// Adds the fields `filters` (within_edges, near_at_rest, excluded_vertex_pairs, patches) and
/// `most_thickness`.
void add_to(nlohmann::ordered_json& report, const ModelSummary& summary);

}  // namespace warmfront::client

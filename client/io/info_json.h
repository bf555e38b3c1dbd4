// SPDX-License-Identifier: Apache-2.0
// info.json beside meshes: the scene's name, bodies, filters and thickness. Pure functions over bytes.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "engine/result.h"
#include "engine/scene.h"

namespace warmfront::client {

struct SceneInfo {
  std::string name;
  std::uint64_t triangles = 0;
  std::uint64_t vertices = 0;
  std::uint64_t frames = 0;
  double fps = 30;
  std::vector<Body> bodies;
  std::vector<std::array<std::uint32_t, 2>> excluded_pairs;
  PairFilters filters;            ///< without the rest shape, which is the first frame
  std::vector<double> thickness;  ///< of each vertex, or empty
  std::string generator;
};

/// "deformable", "rigid", "static" or "removed".
std::string_view to_string(BodyKind kind);

/// Reads an object with any of the fields "name", "triangles", "vertices", "frames", "fps", "generator" and
/// "bodies", a list of {"name", "first_vertex" (where the body before ends, if it is not given), "vertex_count",
/// "kind", "self_collision", "group", "mask", "thickness", "world", "half_space": {"point": [x, y, z], "normal": [x, y, z]}}, "excluded_pairs", a list of
/// pairs of indices of bodies, and "filters", an object with any of
/// "within_edges", "near_at_rest", "excluded_vertex_pairs" and "patches", as PairFilters has them, and
/// "vertex_thickness", a length for each vertex. Other fields are ignored, but not within a body or the
/// filters, nor where two letters make one of the last four: these are errors. Errors name `file` and the
/// byte, or the field and body. Scene::create() checks whether all fit together.
Result<SceneInfo> parse_info_json(std::string_view bytes, std::string_view file);

/// All fields, indented, with a final line end.
std::string format_info_json(const SceneInfo& info);

}  // namespace warmfront::client

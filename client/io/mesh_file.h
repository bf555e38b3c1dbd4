// SPDX-License-Identifier: Apache-2.0
// Reads all mesh formats. Pure functions.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "client/io/mesh.h"
#include "engine/result.h"

namespace warmfront::client {

/// Whether the name ends in .ply, .obj or .stl, in any case.
bool is_mesh_file_name(std::string_view path);

/// Reads the mesh file at `path`, by its extension, with polygons as fans: for a frame, whose faces come from
/// another file. Errors name the file and the place in it.
Result<Mesh> read_listed_mesh(const std::string& path);

/// Turns a mesh as listed in `path` into a scene's mesh: cuts polygons into triangles by their positions in
/// this file. Fails for a polygon that crosses itself.
Status make_scene_mesh(Mesh& mesh, const std::string& path);

/// Both steps: the mesh of a scene.
Result<Mesh> read_mesh(const std::string& path);

/// Warnings, a sentence each: vertices in no face and no edge.
std::vector<std::string> notes_on(const Mesh& mesh, const std::string& path);

}  // namespace warmfront::client

// SPDX-License-Identifier: Apache-2.0
// One door to the mesh formats. Pure functions.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "client/io/mesh.h"
#include "engine/result.h"

namespace warmfront::client {

/// Whether the name ends in .ply, .obj or .stl, in any case.
bool is_mesh_file_name(std::string_view path);

/// Reads the mesh file at `path`, by its extension, polygons as fans: of a frame, whose scene is that of
/// another file. Errors name the file and the place in it.
Result<Mesh> read_listed_mesh(const std::string& path);

/// Makes of a mesh as listed in `path` that of a scene: polygons are cut into triangles where they lie in
/// this file. Fails for one that crosses itself, and for a mesh without faces.
Status make_scene_mesh(Mesh& mesh, const std::string& path);

/// Both: the mesh of a scene.
Result<Mesh> read_mesh(const std::string& path);

/// What of the file is not part of its scene, or only in part, a sentence each: vertices in no face, lone
/// edges.
std::vector<std::string> notes_on(const Mesh& mesh, const std::string& path);

}  // namespace warmfront::client

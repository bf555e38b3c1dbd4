// SPDX-License-Identifier: Apache-2.0
// One door to the mesh formats. Pure functions.
#pragma once

#include <string>
#include <string_view>

#include "client/io/mesh.h"
#include "engine/result.h"

namespace warmfront::client {

/// Whether the name ends in .ply, .obj or .stl, in any case.
bool is_mesh_file_name(std::string_view path);

/// Reads the mesh file at `path`, by its extension. Errors name the file and the place in it.
Result<Mesh> read_mesh(const std::string& path);

}  // namespace warmfront::client

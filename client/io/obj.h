// SPDX-License-Identifier: Apache-2.0
// Wavefront OBJ, as far as a collision scene needs it. Pure functions over bytes.
#pragma once

#include <string_view>

#include "client/io/mesh.h"
#include "engine/result.h"

namespace warmfront::client {

/// Reads the `v`, `f` and `l` lines of an OBJ file; all others are skipped. An `l` line of k vertices is k -
/// 1 edges, each of two different vertices. Vertices keep their order and are rounded to the nearest double;
/// weights and colours after the third coordinate are ignored; polygons become fans, and are listed; a face
/// may repeat a vertex; indices may be relative (negative) and carry texture and normal indices. A backslash
/// continues a line. Errors name `file`, the line and what is wrong with it. Read by hand because
/// tinyobjloader turns a malformed coordinate into 0 and an index out of range into a warning, and rounds
/// decimals inexactly: a mesh would not come back as the bits that were saved.
Result<Mesh> parse_obj(std::string_view bytes, std::string_view file);

}  // namespace warmfront::client

// SPDX-License-Identifier: Apache-2.0
// STL (stereolithography), ASCII and binary. Pure functions over bytes.
#pragma once

#include <string_view>

#include "client/io/mesh.h"
#include "engine/result.h"

namespace warmfront::client {

/// Reads an STL file. STL has no vertex indices: corners whose three coordinates have equal bits become one
/// vertex, and vertices are numbered in the order in which they first appear (so 0.0 and -0.0 differ, and
/// nothing is welded by distance). Binary coordinates are held as float, ASCII ones as double. Normals and
/// attributes are ignored. A file whose size fits its binary triangle count is binary, whatever it starts
/// with. A facet with two corners in the same place is a face that repeats a vertex. Errors name `file`, the
/// line or byte, and what is wrong: truncation, or a count that the file cannot hold.
Result<Mesh> parse_stl(std::string_view bytes, std::string_view file);

}  // namespace warmfront::client

// SPDX-License-Identifier: Apache-2.0
// PLY (Stanford polygon format), read and written. Pure functions over bytes.
#pragma once

#include <string>
#include <string_view>

#include "client/io/mesh.h"
#include "engine/result.h"

namespace warmfront::client {

/// Reads a PLY file: ASCII or binary of either byte order, any scalar type for coordinates, list lengths and
/// indices. Vertices keep their order; polygons become fans, and are listed; a face may repeat a vertex;
/// an `edge` has the properties vertex1 and vertex2, which differ; other elements and properties are skipped.
/// Coordinates are held as float when float or a small integer holds all of them exactly, else as double; NaN
/// and infinities pass. A file without faces and edges is a set of points. Errors name `file`, the line
/// (ASCII) or byte (binary), and the entry: truncation, an index out of range, a polygon with fewer than
/// three corners. Memory stays within a small multiple of the bytes given.
Result<Mesh> parse_ply(std::string_view bytes, std::string_view file);

/// The mesh as binary little-endian PLY, in the precision that it holds. `comment` (one line) may be empty.
std::string format_ply(const Mesh& mesh, std::string_view comment);

}  // namespace warmfront::client

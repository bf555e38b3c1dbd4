// SPDX-License-Identifier: Apache-2.0
// Cuts polygons into triangles that cover exactly the polygon. Pure functions.
#pragma once

#include <string_view>

#include "client/io/mesh.h"
#include "engine/result.h"

namespace warmfront::client {

/// Replaces the fans of concave polygons in `mesh.polygons`, which reach outside them, by triangles that
/// cover them once: ear clipping (Meisters 1975) in the coordinate plane nearest to the polygon's, with exact
/// predicates. Convex polygons keep their fans, and so do those with a non-finite corner, which the engine
/// refuses. The triangles take the place of the fan. kInvalidArgument, naming `file` and the polygon's place
/// in it, if the polygon crosses itself, so that no such triangles exist, and for concave polygons of more
/// than 1,024 corners.
Status triangulate(Mesh& mesh, std::string_view file);

}  // namespace warmfront::client

// SPDX-License-Identifier: Apache-2.0
// Polygons cut into triangles that cover them and nothing else. Pure functions.
#pragma once

#include <string_view>

#include "client/io/mesh.h"
#include "engine/result.h"

namespace warmfront::client {

/// Replaces the fans of `mesh.polygons` that reach outside their polygons, which are the concave ones, by
/// triangles that cover them once: ear clipping (Meisters 1975) in the coordinate plane that the polygon
/// faces most, with exact predicates. Convex polygons keep their fans, and so do those with a corner that is
/// not finite, which the engine refuses by its vertex. The triangles of a polygon stay where its fan was.
/// kInvalidArgument, naming `file` and the polygon's place in it, where no such triangles exist because it
/// crosses itself, and for concave polygons of more than 1,024 corners.
Status triangulate(Mesh& mesh, std::string_view file);

}  // namespace warmfront::client

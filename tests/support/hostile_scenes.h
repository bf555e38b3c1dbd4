// SPDX-License-Identifier: Apache-2.0
// Scenes that need much more work than their number of triangles suggests: inputs for tests of bounds on
// memory and time. Pure functions.
#pragma once

#include <cstdint>
#include <vector>

#include "engine/scene.h"

namespace warmfront::testing {

/// A scene's description, and its positions.
struct HostileScene {
  SceneDescription description;
  std::vector<double> positions;  ///< (n, 3)
};

/// One deformable surface of about `faces` triangles, a square grid, with all its vertices in one point.
HostileScene collapsed_grid(int faces);
/// One deformable strip of n vertices and n - 2 triangles, with all its vertices in one point.
HostileScene collapsed_strip(int n);
/// `bodies` bodies of one triangle each, all in the same place.
HostileScene coincident_triangles(int bodies, BodyKind kind);
/// `faces` triangles around vertex 0, the hub; each shares an edge with the next. A disc with a winding rim.
HostileScene fan(int faces);
/// `faces` triangles along one edge, like the pages of a book.
HostileScene book(int faces);
/// A regular flat n x n grid of quads at unit distances: large, but not hostile.
HostileScene flat_grid(int n);

}  // namespace warmfront::testing

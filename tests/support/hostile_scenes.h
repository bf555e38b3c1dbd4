// SPDX-License-Identifier: Apache-2.0
// Scenes that ask for much more work than they have triangles: what bounds on memory and time are tested
// with. Pure functions.
#pragma once

#include <cstdint>
#include <vector>

#include "engine/scene.h"

namespace warmfront::testing {

/// A scene as its creator gives it, and where its vertices are.
struct HostileScene {
  SceneDescription description;
  std::vector<double> positions;  ///< (n, 3)
};

/// One deformable surface of about so many triangles, a square grid, with all its vertices in one point.
HostileScene collapsed_grid(int faces);
/// One deformable strip of n vertices and n - 2 triangles, with all its vertices in one point.
HostileScene collapsed_strip(int n);
/// So many bodies of one triangle each, all in the same place.
HostileScene coincident_triangles(int bodies, BodyKind kind);
/// So many triangles around vertex 0, the hub; each shares an edge with the next. A disc, of a winding rim.
HostileScene fan(int faces);
/// So many triangles along one edge, like the pages of a book.
HostileScene book(int faces);
/// A regular n x n grid of quads, flat and at unit distances: nothing hostile but its size.
HostileScene flat_grid(int n);

}  // namespace warmfront::testing

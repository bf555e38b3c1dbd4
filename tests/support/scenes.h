// SPDX-License-Identifier: Apache-2.0
// Small scenes for tests: regular shapes with known counts, and random ones with every legal degeneracy.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <random>
#include <vector>

#include "engine/scene.h"

namespace warmfront::testing {

using Faces = std::vector<std::array<std::int32_t, 3>>;
using Edges = std::vector<std::array<std::int32_t, 2>>;

std::shared_ptr<const Scene> make_scene(std::uint32_t vertex_count, Faces faces, Edges edges = {});

/// Appends the scene's faces and lone edges, with `first` added to their vertices, as a description has them.
void append_elements(const Scene& scene, std::uint32_t first, Faces& faces, Edges& edges);

Faces tetrahedron();  ///< 4 vertices
Faces octahedron();   ///< 6 vertices
/// n x n quads, each two triangles; vertex (i, j) is i * (n + 1) + j.
Faces grid(int n);

/// A random mesh of: sheets with boundaries, closed bodies, fins (non-manifold edges), bow-ties, duplicate
/// and flipped faces, strands of edges that hang free or on these, isolated vertices and unconnected triangles.
struct RandomScene {
  std::shared_ptr<const Scene> scene;
  std::vector<double> positions;
};
RandomScene random_scene(std::mt19937_64& random);

/// The next frame: each vertex moves by up to `step`, some bodies stay, and occasionally everything moves
/// far.
std::vector<double> random_motion(std::mt19937_64& random, const Scene& scene,
                                  const std::vector<double>& positions);

}  // namespace warmfront::testing

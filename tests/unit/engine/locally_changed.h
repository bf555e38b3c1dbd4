// SPDX-License-Identifier: Apache-2.0
// A sheet of which some elements are others, near each other.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <random>
#include <utility>
#include <vector>

#include "engine/scene.h"
#include "tests/support/scenes.h"

namespace warmfront {

using testing::Faces;
using testing::grid;
using Edges = std::vector<std::array<std::int32_t, 2>>;

inline constexpr int kSide = 36;  // a hierarchy of several subtrees
inline constexpr std::uint32_t kVertices =
    (kSide + 1) * (kSide + 1) + 3;  // the last three are of edges, or isolated

inline std::vector<double> sheet() {
  std::vector<double> positions;
  for (std::uint32_t v = 0; v < kVertices; ++v)
    positions.insert(positions.end(), {1.0 * (v / (kSide + 1)), 1.0 * (v % (kSide + 1)), 0.0});
  return positions;
}
inline Scene scene_of(Faces faces, Edges edges) {
  SceneDescription description{kVertices, std::move(faces), {{"", 0, kVertices}}};
  description.edges = std::move(edges);
  return Scene::create(std::move(description)).value();
}

// A few faces near each other deleted, turned over, or put in; perhaps an edge added or removed.
inline void change_locally(Faces& faces, Edges& edges, std::mt19937& random) {
  const auto below = [&](std::size_t n) { return random() % n; };
  const std::size_t at = below(faces.size() - 8);
  for (std::size_t i = 1 + below(4); i > 0; --i) {
    const std::size_t f = at + below(6);
    switch (below(4)) {
      case 0:
        faces.erase(faces.begin() + static_cast<std::ptrdiff_t>(f));
        break;
      case 1:
        std::swap(faces[f][0], faces[f][1]);
        break;
      case 2:
        faces.insert(faces.begin() + static_cast<std::ptrdiff_t>(f), faces[at]);
        break;
      default:
        faces.push_back({faces[f][0], faces[at][1], faces[f][2]});
        break;
    }
  }
  if (below(5) == 0) faces.push_back({faces[at][0], faces[at][0], faces[at][1]});
  if (below(3) == 0) edges.push_back({faces[at][0], static_cast<std::int32_t>(kVertices - 1 - below(3))});
  if (below(4) == 0 && !edges.empty()) edges.erase(edges.begin());
}

}  // namespace warmfront

// SPDX-License-Identifier: Apache-2.0
#include "engine/scene/orphans.h"

#include <algorithm>
#include <string>

#include "engine/scene/adjacency.h"

namespace warmfront {
namespace {

bool is_orphan_vf(const Scene& scene, std::uint32_t v, const Face& face) {
  return std::ranges::all_of(scene.vertex_faces()[v],
                             [&](std::uint32_t g) { return adjacent(scene.faces()[g], face); });
}

bool is_orphan_ee(const Scene& scene, std::uint32_t e1, std::uint32_t e2) {
  return std::ranges::all_of(scene.edge_faces()[e1], [&](std::uint32_t g) {
    return std::ranges::all_of(scene.edge_faces()[e2],
                               [&](std::uint32_t h) { return adjacent(scene.faces()[g], scene.faces()[h]); });
  });
}

}  // namespace

Status check_hubs(const Scene& scene) {
  std::uint64_t adjacencies = 0;
  std::uint64_t greatest = 0;
  std::uint32_t hub = 0;
  for (std::uint32_t v = 0; v < scene.vertex_count(); ++v) {
    const std::uint64_t degree = scene.vertex_faces()[v].size();
    adjacencies += degree * degree;
    if (degree > greatest) {
      greatest = degree;
      hub = v;
    }
  }
  if (adjacencies < kMostAdjacencies) return {};
  return Error{ErrorCode::kResourceExhausted,
               "faces: " + std::to_string(adjacencies) + " pairs of faces share a vertex, more than " +
                   std::to_string(kMostAdjacencies) + "; vertex " + std::to_string(hub) + " alone is in " +
                   std::to_string(greatest) + " faces: split it"};
}

Orphans enumerate_orphans(const Scene& scene) {
  Orphans orphans;
  std::vector<std::uint32_t> around;  // the faces that share a vertex with f
  for (std::uint32_t f = 0; f < scene.face_count(); ++f) {
    const Face& face = scene.faces()[f];
    around.clear();
    for (const std::uint32_t v : face) {
      const auto faces = scene.vertex_faces()[v];
      around.insert(around.end(), faces.begin(), faces.end());
    }
    std::sort(around.begin(), around.end());
    around.erase(std::unique(around.begin(), around.end()), around.end());

    // All faces of an orphan's features are adjacent to f's side, the first ones too: looking only from the
    // first face of each feature finds every orphan, and finds it once.
    for (const std::uint32_t g : around) {
      for (const std::uint32_t v : scene.faces()[g]) {
        if (scene.vertex_faces()[v].front() == g && !has_vertex(face, v) && is_orphan_vf(scene, v, face)) {
          orphans.vertex_face.push_back({v, f});
        }
      }
      for (const std::uint32_t e1 : scene.face_edges()[f]) {
        if (scene.edge_faces()[e1].front() != f) continue;
        for (const std::uint32_t e2 : scene.face_edges()[g]) {
          if (e1 < e2 && scene.edge_faces()[e2].front() == g &&
              !share_vertex(scene.edges()[e1], scene.edges()[e2]) && is_orphan_ee(scene, e1, e2)) {
            orphans.edge_edge.push_back({e1, e2});
          }
        }
      }
    }
  }
  std::sort(orphans.vertex_face.begin(), orphans.vertex_face.end());
  std::sort(orphans.edge_edge.begin(), orphans.edge_edge.end());
  return orphans;
}

}  // namespace warmfront

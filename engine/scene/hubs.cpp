// SPDX-License-Identifier: Apache-2.0
// Which scenes have too many pairs of faces around a vertex.
#include <algorithm>
#include <string>

#include "engine/scene/orphans.h"

namespace warmfront {

Status check_hubs(const Scene& scene, StopSignal stop, std::uint32_t* worst) {
  PacedStop paced(stop);
  std::uint64_t adjacencies = 0;
  std::uint64_t corners = 0;
  std::uint64_t ends = 0;
  std::uint64_t greatest = 0;
  std::uint32_t hub = 0;
  const auto count = [&](std::uint32_t first, std::uint32_t end) {
    for (std::uint32_t v = first; v < end; ++v) {
      paced.check();
      const std::uint64_t faces = scene.vertex_faces()[v].size();
      const std::uint64_t degree = faces + scene.lone_edges_of(v).size();
      adjacencies += degree * degree;
      corners += faces;
      ends += degree - faces;
      if (degree > greatest) {
        greatest = degree;
        hub = v;
      }
    }
  };
  if (scene.bodies().empty()) count(0, scene.vertex_count());
  for (const Body& body : scene.bodies()) {
    paced.check();
    if (body.kind == BodyKind::kDeformable && body.self_collision)
      count(body.first_vertex, body.first_vertex + body.vertex_count);
  }
  const std::uint64_t most = std::max(kMostAdjacencies, kMostAdjacenciesAFace * (corners / 3 + ends / 2));
  if (adjacencies < most) return {};
  if (worst != nullptr) *worst = hub;
  const std::string elements = ends > 0 ? " faces and edges" : " faces";
  return Error{ErrorCode::kResourceExhausted,
               "faces: " + std::to_string(adjacencies) + " pairs of" + elements +
                   " share a vertex of bodies that are tested against themselves, more than " +
                   std::to_string(most) + "; vertex " + std::to_string(hub) + " alone is in " +
                   std::to_string(greatest) + elements +
                   ": split it, or switch its body's self_collision off"};
}

}  // namespace warmfront

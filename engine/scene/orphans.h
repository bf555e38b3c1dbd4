// SPDX-License-Identifier: Apache-2.0
// Orphan sets: the elementary tests that only adjacent triangle pairs would offer (Tang, Curtis, Yoon,
// Manocha 2008; Tang, Manocha, Tong 2009, section 4.1). Enumerated once per topology; immutable.
#pragma once

#include <cstdint>
#include <vector>

#include "engine/scene.h"
#include "engine/stop.h"

namespace warmfront {

/// A vertex and a face, or two edges (a < b).
struct FeatureIds {
  std::uint32_t a;
  std::uint32_t b;
  friend auto operator<=>(const FeatureIds&, const FeatureIds&) = default;
};

struct Orphans {
  /// (v, f): v is not in f, and every face around v shares a vertex with f. Vertices of no face are no
  /// orphans: they are primitives of the hierarchy themselves.
  std::vector<FeatureIds> vertex_face;
  /// (e1, e2): no shared vertex, and every pair of a face along e1 and a face along e2 shares a vertex.
  std::vector<FeatureIds> edge_edge;
};

/// Fails with kResourceExhausted, naming the vertex of most faces, where the faces around hub vertices of
/// bodies that are tested against themselves would make too many pairs, counted at each vertex: more than
/// kMostAdjacencies (one vertex of 2,000 faces does), and more than kMostAdjacenciesAFace for each of their
/// faces (no mesh whose vertices have 64 faces each does). Every pair of faces around a vertex is adjacent,
/// so the orphan sets grow with the square of its degree, to some 20 bytes a pair. O(n). Then `hub`, unless
/// it is null, is that vertex. Throws Stopped when told to stop.
Status check_hubs(const Scene& scene, StopSignal stop = {}, std::uint32_t* hub = nullptr);
inline constexpr std::uint64_t kMostAdjacencies = 4'000'000;
inline constexpr std::uint64_t kMostAdjacenciesAFace = 256;

/// Those whose first feature is in `range`, which faces do not lead out of. Sorted. Parallel inside
/// Workers::run(). O(sum over edges of (faces around its first face's vertices)): quadratic in the degree of
/// a hub vertex, as its orphans are. Throws Stopped when told to stop.
Orphans enumerate_orphans(const Scene& scene, const FeatureRange& range, StopSignal stop = {});
inline Orphans enumerate_orphans(const Scene& scene) {
  return enumerate_orphans(scene, whole(scene));
}

}  // namespace warmfront

// SPDX-License-Identifier: Apache-2.0
// Orphan sets: the elementary tests that occur only in adjacent triangle pairs (Tang, Curtis, Yoon, Manocha
// 2008; Tang, Manocha, Tong 2009, section 4.1). Enumerated once per topology; immutable.
#pragma once

#include <cstdint>
#include <vector>

#include "engine/scene.h"
#include "engine/scene/local_change.h"
#include "engine/scene/numbers.h"
#include "engine/scene/scene_edges.h"
#include "engine/scene/scene_join.h"
#include "engine/stop.h"

namespace warmfront {

/// Two features.
template <class A, class B>
struct FeatureIds {
  A a;
  B b;
  friend auto operator<=>(const FeatureIds&, const FeatureIds&) = default;
};
using VertexFaceIds = FeatureIds<NewVertex, NewFace>;
using EdgeEdgeIds = FeatureIds<EdgeId, EdgeId>;  ///< a < b
using EdgeFaceIds = FeatureIds<EdgeId, NewFace>;

struct Orphans {
  /// (v, f): v is not in f, and every face around v shares a vertex with f; where v is in no face, the first
  /// lone edge around it does. Isolated vertices have none: they are primitives of the hierarchy.
  std::vector<VertexFaceIds> vertex_face;
  /// (e1, e2): no shared vertex, and every pair of a face along e1 and a face along e2 shares a vertex; a
  /// lone edge stands for the faces along it.
  std::vector<EdgeEdgeIds> edge_edge;
};

/// Fails with kResourceExhausted, naming the vertex with most faces and lone edges, where hub vertices of
/// bodies that are tested against themselves have too many pairs of these: more than kMostAdjacencies (a
/// vertex of 2,000 faces has), and more than kMostAdjacenciesAFace per face or lone edge (no mesh with 64
/// faces per vertex has). Every pair of faces around a vertex is adjacent, so the orphan sets grow with the
/// square of its degree, at about 20 bytes a pair. O(n). Writes that vertex to `hub` unless null. Throws
/// Stopped when told to stop.
Status check_hubs(const Scene& scene, StopSignal stop = {}, std::uint32_t* hub = nullptr);
inline constexpr std::uint64_t kMostAdjacencies = 4'000'000;
inline constexpr std::uint64_t kMostAdjacenciesAFace = 256;

/// The orphans whose first feature is in `range`, which must be closed under faces. Sorted. Parallel inside
/// Workers::run(). O(sum over edges of (faces around its first face's vertices)): quadratic in the degree of
/// a hub vertex, as is the result. Throws Stopped when told to stop.
Orphans enumerate_orphans(const Scene& scene, const FeatureRange& range, StopSignal stop = {});
/// The same of a body alone that has changed locally, renumbered: `before` are those of when it was `part` of
/// a scene. What has nothing to do with the change is taken over. O(n). Parallel inside Workers::run().
/// Throws Stopped when told to stop.
Orphans enumerate_orphans(const Scene& scene, const Orphans& before, const MeshRange& part,
                          const LocalChange& change, StopSignal stop);
/// Of questions that ask which edges meet which faces, the same: edges in `range` and faces without a common
/// vertex to which all faces along the edge are adjacent, (edge, face), sorted. O(sum over edges of the faces
/// around one vertex).
std::vector<EdgeFaceIds> edge_face_orphans(const Scene& scene, const FeatureRange& range,
                                           StopSignal stop = {});

inline Orphans enumerate_orphans(const Scene& scene) {
  return enumerate_orphans(scene, whole(scene));
}

}  // namespace warmfront

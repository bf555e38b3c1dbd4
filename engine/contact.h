// SPDX-License-Identifier: Apache-2.0
// The contacts that a step reports. Plain values, free to copy between threads.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace warmfront {

/// Vertex-face: `a` is a vertex, `b` a face. Edge-edge: `a` < `b` are edges. Edge-face (intersections alone):
/// `a` is an edge, `b` a face. Where something counts as in contact without touching, also what no face and
/// no edge speaks for: vertex-edge, `a` is an isolated vertex, `b` a lone edge; and vertex-vertex, `a` < `b`
/// are isolated vertices. Vertex-half-space: `a` is a vertex, any of a body with a mesh, `b` the body that is
/// a half-space.
enum class ContactKind : std::uint8_t {
  kVertexFace = 0,
  kEdgeEdge = 1,
  kEdgeFace = 2,
  kVertexEdge = 3,
  kVertexVertex = 4,
  kVertexHalfSpace = 5,
};
inline constexpr std::size_t kContactKinds = 6;

/// So many of a pair's four vertices are of its first feature. A vertex that is tested as an edge without
/// length stands for both of its ends. Of vertex-half-space: see Scene::vertices_of().
constexpr std::size_t vertices_of_first(ContactKind kind) {
  if (kind == ContactKind::kVertexHalfSpace) return 3;
  return kind == ContactKind::kVertexFace ? 1 : 2;
}
/// How a pair is tested: vertex-edge and vertex-vertex as edge-edge.
constexpr ContactKind tested_as(ContactKind kind) {
  const bool of_points = kind == ContactKind::kVertexEdge || kind == ContactKind::kVertexVertex;
  return of_points ? ContactKind::kEdgeEdge : kind;
}

/// How many there are of each kind.
struct KindCounts {
  std::uint64_t vf = 0;  ///< vertex-face
  std::uint64_t ee = 0;  ///< edge-edge, and all in which an isolated vertex stands for an edge:
  std::uint64_t ve = 0;  ///< of these, vertex-edge
  std::uint64_t vv = 0;  ///< of these, vertex-vertex
  std::uint64_t ef = 0;  ///< edge-face
  std::uint64_t vh = 0;  ///< vertex-half-space

  void count(ContactKind kind) {
    vf += kind == ContactKind::kVertexFace;
    ee += tested_as(kind) == ContactKind::kEdgeEdge;
    ve += kind == ContactKind::kVertexEdge;
    vv += kind == ContactKind::kVertexVertex;
    ef += kind == ContactKind::kEdgeFace;
    vh += kind == ContactKind::kVertexHalfSpace;
  }
  void add(const KindCounts& more) {
    vf += more.vf;
    ee += more.ee;
    ve += more.ve;
    vv += more.vv;
    ef += more.ef;
    vh += more.vh;
  }
  std::uint64_t total() const { return vf + ee + ef + vh; }

  friend bool operator==(const KindCounts&, const KindCounts&) = default;
};

/// Certainty of the elementary test. Pairs that are certainly clear are not reported and have no value here.
enum class ContactStatus : std::uint8_t {
  kHit = 1,       ///< proved: the primitives meet within the step, or are within the distance (proximity)
  kPossible = 2,  ///< they come within tolerance of that; neither a meeting nor a miss could be proved
  kOverlapAtStart = 3,  ///< not provably apart at t = 0: toi is 0
  kBudget = 4,          ///< the test's budget ended undecided; toi is the earliest time not yet excluded
};

/// Which features of the two primitives have the closest points: a vertex or an edge's interior of one, and a
/// vertex, an edge's interior or the face's interior of the other.
enum class ClosestFeatures : std::uint8_t {
  kVertexVertex = 0,
  kEdgeVertex = 1,
  kEdgeEdge = 2,
  kFaceVertex = 3,
};

/// One pair of primitives that meet (or could not be proved apart) on the linear motion from t = 0 to t = 1.
struct Contact {
  ContactKind kind;
  ContactStatus status;
  std::uint32_t a;  ///< vertex or edge, as the kind says
  std::uint32_t b;  ///< face, edge, vertex or body
  /// In [0, 1]: a lower bound of the first time of contact; in tier fast an estimate of it. Of proximity and
  /// intersections the instant that was asked about: 0, or 1 at a trial's end.
  double toi;

  friend bool operator==(const Contact&, const Contact&) = default;
};

/// What a row of a reduced answer of proximity stands for: see ColliderOptions::reduced. stencil.h makes of
/// it what a barrier is summed over.
struct ClosestPair {
  std::uint32_t multiplicity = 1;  ///< how many rows have it where they are not reduced
  /// Bit k: the k-th of the row's four vertices is of the closest features. All four of nearly parallel
  /// edges, wherever their closest points are: ContactGeometry::closest and `weights` say that.
  std::uint8_t stencil = 0b1111;

  friend bool operator==(const ClosestPair&, const ClosestPair&) = default;
};

/// Barycentric coordinates, directions, closest points and distance of a contact or near pair, at its toi, in
/// floating point: not a proof.
struct ContactGeometry {
  /// Of the contact's four vertices at the time of impact: vertex-face: 1, then the barycentric coordinates
  /// of the face's closest point; else those of each edge's closest point, of a vertex that stands for an
  /// edge 1 and 0. Each in [0, 1]; exactly 0 where the closest point is on a side without that vertex, or at
  /// another vertex. Vertex-half-space: 1, 0, 0, 0.
  std::array<double, 4> weights{};
  /// Unit normal of the face, or common normal of the edges, at the time of impact, towards the side that the
  /// vertex or first edge comes from. If degenerate, the direction that it comes from; zero if none. With a
  /// separation it differs from the direction between the closest points if one of these lies on the face's
  /// rim or at an edge's end: see `direction`. Of a half-space always the direction out of it.
  std::array<double, 3> normal{};
  /// The closest point of the vertex or first edge, then of the face or second edge, in the scene's unit. Of
  /// a half-space the foot of the vertex on its plane; the vertex itself where that is inside.
  std::array<double, 6> points{};
  /// Unit vector from the closest point of the face or second edge to that of the vertex or first edge; zero
  /// where they touch.
  std::array<double, 3> direction{};
  /// Of these points, in the scene's unit squared; 0 or infinite where that leaves double's range.
  double squared_distance = 0;
  /// As the zeros of `weights` tell; of a half-space as of a face's interior.
  ClosestFeatures closest = ClosestFeatures::kVertexVertex;
};

}  // namespace warmfront

// SPDX-License-Identifier: Apache-2.0
// The contacts that a step reports. Plain values, free to copy between threads.
#pragma once

#include <array>
#include <cstdint>

namespace warmfront {

/// Vertex-face: `a` is a vertex, `b` a face. Edge-edge: `a` < `b` are edges.
enum class ContactKind : std::uint8_t { kVertexFace = 0, kEdgeEdge = 1 };

/// Certainty of the elementary test. Pairs that are certainly clear are not reported and have no value here.
enum class ContactStatus : std::uint8_t {
  kHit = 1,       ///< proved: the primitives meet within the step
  kPossible = 2,  ///< they come within tolerance of touching; neither a meeting nor a miss could be proved
  kOverlapAtStart = 3,  ///< not provably apart at t = 0: toi is 0
  kBudget = 4,          ///< the test's budget ended undecided; toi is the earliest time not yet excluded
};

/// One pair of primitives that meet (or could not be proved apart) on the linear motion from t = 0 to t = 1.
struct Contact {
  ContactKind kind;
  ContactStatus status;
  std::uint32_t a;  ///< vertex (vertex-face) or edge (edge-edge)
  std::uint32_t b;  ///< face (vertex-face) or edge (edge-edge)
  double toi;       ///< in [0, 1]: a lower bound of the first time of contact; in tier fast an estimate of it

  friend bool operator==(const Contact&, const Contact&) = default;
};

/// Barycentric coordinates, normal and closest points of a contact, in floating point: not a proof.
struct ContactGeometry {
  /// Of the contact's four vertices at the time of impact: vertex-face: 1, then the barycentric coordinates
  /// of the face's closest point; edge-edge: those of each edge's closest point. Each in [0, 1].
  std::array<double, 4> weights{};
  /// Unit normal of the face, or common normal of the edges, at the time of impact, towards the side that the
  /// vertex or first edge comes from. If degenerate, the direction that it comes from; zero if none. With a
  /// separation it differs from the direction between the closest points if one of these lies on the face's
  /// rim or at an edge's end; take that direction from `points`.
  std::array<double, 3> normal{};
  /// The closest point of the vertex or first edge, then of the face or second edge, in the scene's unit.
  std::array<double, 6> points{};
};

}  // namespace warmfront

// SPDX-License-Identifier: Apache-2.0
// What a step reports. Plain values, free to copy between threads.
#pragma once

#include <cstdint>

namespace warmfront {

/// Vertex-face: `a` is a vertex, `b` a face. Edge-edge: `a` < `b` are edges.
enum class ContactKind : std::uint8_t { kVertexFace = 0, kEdgeEdge = 1 };

/// How sure the elementary test is. CLEAR pairs are not reported, so it has no value here.
enum class ContactStatus : std::uint8_t {
  kHit = 1,       ///< proved: the primitives meet within the step
  kPossible = 2,  ///< they come within tolerance of touching; neither a meeting nor a miss could be proved
  kOverlapAtStart = 3,  ///< they are not provably apart at t = 0: toi is 0
  kBudget = 4,          ///< the test's effort ended undecided; toi is the earliest time not yet excluded
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

}  // namespace warmfront

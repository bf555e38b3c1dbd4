// SPDX-License-Identifier: Apache-2.0
// Where and how a contact touches. Pure function, in floating point: a description, not a proof.
#pragma once

#include <array>
#include <span>

#include "engine/elementary/feature_block.h"

namespace warmfront {

struct ContactGeometry {
  /// Of the contact's four vertices at the time of impact: vertex-face 1, then the barycentric coordinates of
  /// the face's closest point; edge-edge those of either edge's closest point. Each in [0, 1].
  std::array<double, 4> weights{};
  /// Unit normal of the face, or common normal of the edges, at the time of impact, towards the side that the
  /// vertex or first edge comes from. Where that is degenerate, the direction that it comes from; zero if
  /// none. It is the features' own: where two things are apart (with a separation) and the closest point lies
  /// on the face's rim or at an edge's end, the direction between the closest points is another one; take
  /// that from `points`.
  std::array<double, 3> normal{};
  /// The closest point of the vertex or first edge, then of the face or second edge, in the scene's unit.
  std::array<double, 6> points{};
};

/// Of four vertices as in FeaturePair that are nearest at `toi`.
/// Source: Ericson, Real-Time Collision Detection, sections 5.1.5 and 5.1.9.
ContactGeometry contact_geometry(ContactKind kind, std::span<const VertexMotion* const, 4> vertices,
                                 double toi);

}  // namespace warmfront

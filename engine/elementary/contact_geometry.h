// SPDX-License-Identifier: Apache-2.0
// Barycentric coordinates, directions, points and distance of a contact. Pure function, in floating point:
// not a proof.
#pragma once

#include <array>
#include <span>

#include "engine/contact.h"
#include "engine/motion/motion.h"

namespace warmfront {

/// Where the closest points of a row are, at the time `toi`.
struct ClosestPlace {
  std::array<double, 4> weights;  ///< as ContactGeometry::weights
  /// Edge-edge alone: |a x b|^2 < 10^-3 |a|^2 |b|^2, of the edges as vectors. Not of an edge that is a point.
  bool parallel;
};
ClosestPlace closest_place(ContactKind kind, std::span<const VertexMotion* const, 4> vertices, double toi);

/// The closest points, at `toi`, of a contact's four vertices (vertex, then the face's three; or edge a's
/// two, then edge b's two). Source: Ericson, Real-Time Collision Detection, sections 5.1.5 and 5.1.9.
ContactGeometry contact_geometry(ContactKind kind, std::span<const VertexMotion* const, 4> vertices,
                                 double toi);

}  // namespace warmfront

// SPDX-License-Identifier: Apache-2.0
// Barycentric coordinates, directions, points and distance of a contact. Pure function, in floating point:
// not a proof.
#pragma once

#include <span>

#include "engine/contact.h"
#include "engine/motion/motion.h"

namespace warmfront {

/// The closest points, at `toi`, of a contact's four vertices (vertex, then the face's three; or edge a's
/// two, then edge b's two). Source: Ericson, Real-Time Collision Detection, sections 5.1.5 and 5.1.9.
ContactGeometry contact_geometry(ContactKind kind, std::span<const VertexMotion* const, 4> vertices,
                                 double toi);

}  // namespace warmfront

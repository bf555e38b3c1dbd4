// SPDX-License-Identifier: Apache-2.0
// Where and how a contact touches. Pure function, in floating point: a description, not a proof.
#pragma once

#include <span>

#include "engine/contact.h"
#include "engine/motion/motion.h"

namespace warmfront {

/// Of a contact's four vertices (vertex, then the face's three; or edge a's two, then edge b's two), which
/// are nearest at `toi`. Source: Ericson, Real-Time Collision Detection, sections 5.1.5 and 5.1.9.
ContactGeometry contact_geometry(ContactKind kind, std::span<const VertexMotion* const, 4> vertices,
                                 double toi);

}  // namespace warmfront

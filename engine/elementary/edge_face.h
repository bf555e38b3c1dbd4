// SPDX-License-Identifier: Apache-2.0
// The elementary test of intersections: does an edge meet a face at one instant? A pure function except for
// the count, safe to call from any thread in the default floating-point environment (Workers checks it).
#pragma once

#include <array>
#include <cstdint>

#include "engine/motion/motion.h"
#include "engine/options.h"

namespace warmfront {

/// An edge's two vertices and a face's three.
using EdgeFaceVertices = std::array<const VertexMotion*, 5>;

/// Do the closed edge and the closed face have a point in common as they stand at `at`, in real arithmetic on
/// the given doubles? For any finite coordinates: coplanar ones, faces without area and edges without length
/// included. Signs of determinants in doubles where these are certain, else in integers; of these, what only
/// GMP can hold is counted in `exact_tests`, and only that allocates. Derivation: README.md, "Edge and face".
bool edge_meets_face(const EdgeFaceVertices& vertices, Instant at, std::uint64_t& exact_tests);

}  // namespace warmfront

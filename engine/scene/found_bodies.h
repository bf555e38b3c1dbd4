// SPDX-License-Identifier: Apache-2.0
// The bodies of a scene that declares none. Pure function.
#pragma once

#include <vector>

#include "engine/scene.h"

namespace warmfront {

/// The finest ranges of vertices that no face leaves, as deformable bodies that cover the scene, in order:
/// its connected components where the mesh lists one after the other. Components whose numbers interleave
/// share a range, and small ones go along with their neighbours, since a body has a cost of its own. None
/// where that would be a single body. O(n + m).
std::vector<Body> found_bodies(const Scene& scene, StopSignal stop = {});

}  // namespace warmfront

// SPDX-License-Identifier: Apache-2.0
// The bodies of a scene that declares none. Pure function.
#pragma once

#include <vector>

#include "engine/scene.h"

namespace warmfront {

/// The finest ranges of vertices closed under faces, as deformable bodies that cover the scene, in order: its
/// connected components if the mesh lists one after the other. Components with interleaved numbers share a
/// range, and small ones join their neighbours, since each body has a cost. Empty if there would be only one
/// body. O(n + m).
std::vector<Body> found_bodies(const Scene& scene, StopSignal stop = {});

}  // namespace warmfront

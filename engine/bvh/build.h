// SPDX-License-Identifier: Apache-2.0
// The order of primitives in a hierarchy. Pure functions.
#pragma once

#include <span>
#include <vector>

#include "engine/bvh/tree_shape.h"
#include "engine/motion/motion.h"
#include "engine/scene.h"
#include "engine/scene/primitives.h"
#include "engine/stop.h"

namespace warmfront {

/// Orders primitives by object-median splits along the widest axis of their centroids at t = 1. While a node
/// holds more than one body (or component), whole bodies are sorted by their own centroids, so that few nodes
/// mix bodies, which move apart. Parallel inside Workers::run(); the result does not depend on the number of
/// threads. O(P log P).
std::vector<Primitive> build_order(const Scene& scene, const Motion& motion, const TreeShape& shape,
                                   std::span<const Primitive> primitives, StopSignal stop = {});

}  // namespace warmfront

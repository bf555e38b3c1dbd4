// SPDX-License-Identifier: Apache-2.0
// How far the vertices of a motion that was begun travel. Used by one thread at a time.
#pragma once

#include "engine/motion/arcs.h"
#include "engine/motion/scene_motion.h"
#include "engine/stop.h"

namespace warmfront {

/// The length of a vector, rounded up; infinite where a difference that it is made of overflowed.
double length_above(double x, double y, double z);

/// How far a vertex travels, rounded up.
double way_of(const VertexMotion& vertex);

/// The greatest way_of() of any vertex, and its part's arc besides, whether its part is placed or not: 0
/// where nothing moves. Parallel; call it inside Workers::run(). Throws Stopped when told to stop.
double longest_way(const SceneMotion& motion, const Arcs& arcs, StopSignal stop);

}  // namespace warmfront

// SPDX-License-Identifier: Apache-2.0
// The separation that all culls go by where each pair has its own: see elementary/keep_distance.h
// and motion/commit_room.h. Called by
// one thread, inside Workers::run().
#pragma once

#include "engine/state/core.h"
#include "engine/stop.h"

namespace warmfront {

/// What is asked of all, core.keep.beyond, and at least as much besides as any pair has room for roundings.
/// Rounded up, as the next is.
double beyond_with_room(const Core& core);

/// At least the separation of every pair in the motion that was begun, by core.keep and core.room, that a
/// contact up to core.window.latest() comes of: where that is less than of all, every other pair is kept by
/// one direction, up to there, farther apart than its own separation and what the test allows itself, which
/// tells of none then (elementary/README.md). Rounded up, so that it, and what depends on it, often stays the
/// same from question to question. Throws Stopped when told to stop.
double widest_separation(const Core& core, StopSignal stop);

/// What culls go by in this turn of the question: that, or less (KeptWindow).
double narrowed_separation(Core& core, double widest);

}  // namespace warmfront

// SPDX-License-Identifier: Apache-2.0
// Overlap tests, dispatched by instruction set. Slabs are closed: touching counts. The sign of a float sum is
// that of the exact sum, so there is no rounding error. Pure functions.
#pragma once

#include <cstdint>

#include "engine/bounds/kdop.h"
#include "engine/bounds/point_bounds.h"

namespace warmfront {

bool overlap(const Aabb& a, const Aabb& b);
bool overlap(const KDop18& a, const KDop18& b);

/// The end of a motion at which a gap is measured: where the next motion begins, which is the end of a step
/// and the start of a trial.
enum class GapAt : std::uint8_t { kStart, kEnd };

/// The distance at one end along the axis where it is largest (halved for a diagonal: see NodeTravel);
/// negative when they overlap.
float separation(const Aabb& a, const Aabb& b, GapAt at = GapAt::kEnd);
float separation(const KDop18& a, const KDop18& b, GapAt at = GapAt::kEnd);

/// The moving bounds of a triangle's vertices; an edge or a vertex repeats a pointer.
struct TriangleBounds {
  const PointBounds* vertex[3];
};

/// Do the moving bounds of two primitives overlap, as slabs of either kind?
template <class Bounds>
bool overlap(const TriangleBounds& f, const TriangleBounds& g);

/// Those feature pairs of two triangles in `wanted` (bits as Ownership::owned) whose moving bounds overlap.
std::uint32_t overlapping_features(const TriangleBounds& f, const TriangleBounds& g, std::uint32_t wanted);
/// The same up to the time `until` < 1.
std::uint32_t overlapping_features(const TriangleBounds& f, const TriangleBounds& g, std::uint32_t wanted,
                                   float until);

}  // namespace warmfront

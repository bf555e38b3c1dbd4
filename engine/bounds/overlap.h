// SPDX-License-Identifier: Apache-2.0
// Overlap tests, dispatched by instruction set, of bounds within a width of each other: 0 where none is given.
// Slabs are closed: touching counts. The sign of a float sum is that of the exact sum, so there is no rounding
// error; with a width, see width.h. Pure functions.
#pragma once

#include <cstdint>

#include "engine/bounds/kdop.h"
#include "engine/bounds/point_bounds.h"
#include "engine/bounds/width.h"

namespace warmfront {

bool overlap(const Aabb& a, const Aabb& b, const Width& width = {});
bool overlap(const KDop18& a, const KDop18& b, const Width& width = {});

/// The end of a motion at which a gap is measured: where the next motion begins, which is the end of a step
/// and the start of a trial.
enum class GapAt : std::uint8_t { kStart, kEnd };

/// The distance at one end along the axis where it is largest (halved for a diagonal: see NodeTravel), of the
/// bounds themselves, without the width; negative when they overlap.
float separation(const Aabb& a, const Aabb& b, GapAt at = GapAt::kEnd, const Width& width = {});
float separation(const KDop18& a, const KDop18& b, GapAt at = GapAt::kEnd, const Width& width = {});

/// The moving bounds of a triangle's vertices; an edge or a vertex repeats a pointer.
struct TriangleBounds {
  const PointBounds* vertex[3];
};

/// Do the moving bounds of two primitives overlap, as slabs of either kind?
template <class Bounds>
bool overlap(const TriangleBounds& f, const TriangleBounds& g, const Width& width = {});

/// Those feature pairs of two triangles in `wanted` (bits as Ownership::owned) whose moving bounds overlap.
std::uint32_t overlapping_features(const TriangleBounds& f, const TriangleBounds& g, std::uint32_t wanted,
                                   const Width& width = {});
/// The same up to the time `until` < 1.
std::uint32_t overlapping_features(const TriangleBounds& f, const TriangleBounds& g, std::uint32_t wanted,
                                   float until, const Width& width);

}  // namespace warmfront

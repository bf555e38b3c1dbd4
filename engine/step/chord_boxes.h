// SPDX-License-Identifier: Apache-2.0
// Boxes about chords of arcs, many at a time: kernels of the stage of parts that turn by much
// (turning_stage.h). Pure functions.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "engine/screw.h"

namespace warmfront {

/// A point, or a corner of a box; the fourth number is 0.
using Corner = std::array<double, 4>;

struct ChordBox {
  Corner low;
  Corner high;
};

inline void add(ChordBox& all, const ChordBox& other) {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    all.low[axis] = std::min(all.low[axis], other.low[axis]);
    all.high[axis] = std::max(all.high[axis], other.high[axis]);
  }
}

/// What holds some of these boxes, one at least.
inline ChordBox around(std::span<const ChordBox> boxes) {
  ChordBox all = boxes.front();
  for (const ChordBox& box : boxes.subspan(1)) add(all, box);
  return all;
}

/// A vertex's path along its arc, as turning::Path has it.
struct ArcPath {
  Corner start;
  Corner way;
  Corner bend;
  Corner turn;
};
struct ArcTime {
  double time;
  ArcShares shares;
};
/// Where a path is at these times, to the bits of turning::Path::at(): the first at to[0], each next one
/// `stride` further.
void along_arc(const ArcPath& path, std::span<const ArcTime> times, Corner* to, std::size_t stride);

/// Around some points, one at least.
ChordBox around_points(std::span<const Corner> points);

/// boxes[i]: around the chord between from[i] and to[i].
void around_chords(std::span<const Corner> from, std::span<const Corner> to, ChordBox* boxes);

/// boxes[i]: around those of three vertices, by number.
void around_primitives(std::span<const ChordBox> vertices,
                       std::span<const std::array<std::uint32_t, 3>> corners, ChordBox* boxes);

/// Where the corners of a face are at successive times.
using FaceTimes = std::span<const std::array<Corner, 3>>;

/// What is more than `room` apart is so much apart, at least, along a diagonal in its coordinates' sum: a
/// little more than the square root of 2.
inline constexpr double kDiagonal = 1.4143;

/// The pairs of features of two faces of whose bounds, between some two successive times, no coordinate is
/// farther apart than `room`, and no sum or difference of two coordinates than kDiagonal times that; what is
/// not a number is not. Bits as Ownership::candidates() has them.
std::uint32_t near_features(FaceTimes f, FaceTimes g, double room);

}  // namespace warmfront

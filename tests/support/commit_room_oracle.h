// SPDX-License-Identifier: Apache-2.0
// What room max_step() leaves for the roundings of a commit, written down once more. Pure functions.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <vector>

#include "engine/contact.h"
#include "engine/elementary/half_space.h"
#include "engine/elementary/query.h"
#include "engine/elementary/start_gap.h"
#include "engine/elementary/verdict.h"
#include "engine/options.h"

namespace warmfront::testing {

/// Of a body that moves from pose to pose: how its vertices are rounded. `share` 0: it does not.
struct PosedRounding {
  double share = 0;
  double translation = 0;  ///< the largest coordinate of that of either pose
};

inline double share_of(Rounding rounding) {
  return rounding == Rounding::kFloat32 ? 0x1p-22 : 0x1p-44;
}

/// Of a vertex; `posed`: of its body.
inline double room_of(const VertexMotion& vertex, Rounding rounding, const PosedRounding& posed = {}) {
  const auto& [from, to] = vertex;
  double size = 0;
  for (std::size_t axis = 0; axis < 3; ++axis)
    size = std::max({size, std::abs(from[axis]), std::abs(to[axis])});
  const double least = rounding == Rounding::kFloat32 ? 0x1p-148 : 0x1p-1070;
  if (posed.share > 0) return posed.share * 3 * posed.translation + posed.share * 2 * size + least;
  return std::memcmp(from.data(), to.data(), 3 * sizeof(double)) != 0 ? share_of(rounding) * size + least : 0;
}

/// Of a vertex and a half-space, with the rounding of either's body.
inline double room_of(const VertexMotion& vertex, const HalfSpaceMotion& half_space, Rounding rounding,
                      const PosedRounding& of_vertex, const PosedRounding& of_half_space) {
  const double own = room_of(vertex, rounding, of_vertex);
  if (of_half_space.share == 0) return own;
  double size = 0, point = 0;
  for (const auto& at : {vertex.t0, vertex.t1}) {
    for (std::size_t axis = 0; axis < 3; ++axis) size = std::max(size, std::abs(at[axis]));
  }
  for (const auto& at : half_space.point) {
    for (const double x : at) point = std::max(point, std::abs(x));
  }
  const auto& [share, translation] = of_half_space;
  const double least = rounding == Rounding::kFloat32 ? 0x1p-148 : 0x1p-1070;
  const auto of = [&](double x) { return share * 3 * translation + share * 2 * x; };
  return own + (of(size) + of(point) + least);
}

/// Of a pair of features; `posed`: by vertex of the pair, of its body.
inline double room_of(const FeatureVertices& features, Rounding rounding,
                      const std::array<PosedRounding, 4>& posed = {}) {
  double room = 0;
  for (std::size_t k = 0; k < 4; ++k) room = std::max(room, room_of(*features.vertex[k], rounding, posed[k]));
  return room;
}

/// How far a pair may go, by a test that is given a separation, and until which tolerance a time counts as
/// found. It stops four rooms beyond what is asked for, or two where it starts nearer than that. What starts
/// nearer still overlaps; without those that do, it stops at the first of what is asked for, the room and 0,
/// by size, that it starts beyond; else at its start, unless it comes no nearer than it starts.
template <class Test, class ComesNearer>
Verdict with_room(double asked, double room, bool leave_out_overlaps, const StartGap& start, double tolerance,
                  Test&& test, ComesNearer&& comes_nearer) {
  const auto at_start = [](const Verdict& verdict) {
    return verdict.contact && verdict.status == ContactStatus::kOverlapAtStart;
  };
  const Verdict without = test(asked, tolerance);
  if (room == 0 && !at_start(without)) return without;
  std::vector<double> separations{asked + 4 * room, asked + 2 * room};
  if (leave_out_overlaps)
    separations.insert(separations.end(), {std::max(asked, room), std::min(asked, room), 0});
  for (const double separation : separations) {
    Verdict verdict = test(separation, tolerance);
    if (at_start(verdict)) continue;
    if (separation > std::max(asked, room) && verdict.contact && without.contact && !at_start(without))
      verdict.status = without.status;
    return verdict;
  }
  const Verdict overlap{true, ContactStatus::kOverlapAtStart, 0};
  if (leave_out_overlaps) return overlap;
  const double as_near = std::max(room, start.least - std::max(room, std::ldexp(start.size, -42)));
  const double within = std::max(std::ldexp(1, -50), (start.least - as_near) / start.size / 128);
  return comes_nearer(as_near, std::min(tolerance, within)).contact ? overlap : Verdict{};
}

}  // namespace warmfront::testing

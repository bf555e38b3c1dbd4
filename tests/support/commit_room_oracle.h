// SPDX-License-Identifier: Apache-2.0
// What room max_step() leaves for the roundings of a commit, written down once more. Pure functions.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <functional>
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

/// Has the vertex, at both ends, the kind of numbers that it is rounded to?
inline bool rounds_to_its_kind(const VertexMotion& vertex, Rounding rounding) {
  const auto is_float = [](double x) { return double{static_cast<float>(x)} == x; };
  const auto of_floats = [&](const std::array<double, 4>& at) {
    return is_float(at[0]) && is_float(at[1]) && is_float(at[2]);
  };
  return rounding == Rounding::kFloat64 || (of_floats(vertex.t0) && of_floats(vertex.t1));
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
  const double share = of_half_space.share, translation = of_half_space.translation;
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

/// What the rules ask of a pair; see WithRoom.
struct RoomOracle {
  double size = 0;      ///< of the pair
  double rounding = 0;  ///< what a commit may round it by: 0 where nothing moves
  StartGap start;
  bool keeps_its_side = false;                ///< whatever a commit rounds
  std::function<Verdict(double)> test;        ///< with this separation
  std::function<bool(double)> starts_within;  ///< at the start
  std::function<bool(double)> comes_within;   ///< this, at any time
};

/// How far a pair may go. It stops four rooms beyond what is asked for, or two where it starts nearer than
/// that. What starts nearer still stops at its start where it comes nearer, by no more than a room while that
/// leaves it a room beyond what is asked for. Overlaps that are left out are asked about once more without a
/// separation, and what touches goes on.
inline Verdict with_room(double asked, bool leave_out_overlaps, const RoomOracle& pair) {
  const auto at_start = [](const Verdict& verdict) {
    return verdict.contact && verdict.status == ContactStatus::kOverlapAtStart;
  };
  if (pair.rounding == 0) return {};
  const double room = std::max(pair.rounding, std::ldexp(std::max(pair.size, asked), -44));
  std::vector<double> separations{asked};
  if (leave_out_overlaps && asked > 0) separations.push_back(0);
  for (const double separation : separations) {
    const Verdict without = pair.test(separation);
    for (const double times : {4.0, 2.0}) {
      Verdict verdict = pair.test(separation + times * room);
      if (at_start(verdict)) continue;
      if (verdict.contact && without.contact && !at_start(without)) verdict.status = without.status;
      return verdict;
    }
    if (leave_out_overlaps && !pair.starts_within(separation + 2 * room)) {
      separations = {separation};  // it is only taken for near
      break;
    }
  }
  const double slack = pair.start.slack(), least = pair.start.least;
  const double floor = separations.back() + room;
  const double unchanged = least - slack;
  double within = unchanged;
  if (slack > room && least > separations.back())
    within = std::max(unchanged, separations.back());
  else if (slack <= room && least > floor + slack)
    within = std::max(least - room, floor);
  bool stops = !pair.keeps_its_side && !(leave_out_overlaps && pair.starts_within(0));
  if (within >= room || !pair.starts_within(room))
    stops = pair.comes_within(std::max(within, room));
  else if (stops && leave_out_overlaps)
    stops = pair.comes_within(std::max(0.0, unchanged));
  if (!stops) return {};
  return {true, leave_out_overlaps ? ContactStatus::kHit : ContactStatus::kOverlapAtStart, 0};
}

}  // namespace warmfront::testing

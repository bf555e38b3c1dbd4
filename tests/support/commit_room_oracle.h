// SPDX-License-Identifier: Apache-2.0
// What room max_step() leaves for the roundings of a commit, written down once more. Pure functions.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstring>

#include "engine/contact.h"
#include "engine/elementary/half_space.h"
#include "engine/elementary/query.h"
#include "engine/elementary/verdict.h"
#include "engine/options.h"

namespace warmfront::testing {

/// Of a body that moves from pose to pose: how its vertices are rounded. `share` 0: it does not.
struct PosedRounding {
  double share = 0;
  double translation = 0;  ///< the largest coordinate of that of either pose
};

inline double share_of(Rounding rounding) {
  return rounding == Rounding::kFloat32 ? 0x1p-22 : 0x1p-48;
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

/// Of a pair of this kind; `posed`: by vertex of the pair, of its body.
inline double room_of(ContactKind kind, const FeatureVertices& features, Rounding rounding,
                      const std::array<PosedRounding, 4>& posed = {}) {
  if (kind != ContactKind::kVertexFace && kind != ContactKind::kEdgeEdge) return 0;
  double room = 0;
  for (std::size_t k = 0; k < 4; ++k) room = std::max(room, room_of(*features.vertex[k], rounding, posed[k]));
  return room;
}

/// By a test that is given a separation: what is asked for, or four times the room where that is more, or the
/// room where the pair starts within that. How surely what is in contact is, the test for what is asked for
/// tells; where overlaps at the start are left out, it tells all of what starts within the room alone.
template <class Test>
Verdict with_room(double asked, double room, bool leave_out_overlaps, Test&& test) {
  const auto at_start = [](const Verdict& verdict) {
    return verdict.contact && verdict.status == ContactStatus::kOverlapAtStart;
  };
  const Verdict without = test(asked);
  if (4 * room <= asked) return without;
  Verdict verdict = test(4 * room);
  if (at_start(verdict)) verdict = test(std::max(asked, room));
  if (at_start(verdict)) return leave_out_overlaps && room > asked ? without : verdict;
  if (verdict.contact && without.contact && !at_start(without)) verdict.status = without.status;
  return verdict;
}

}  // namespace warmfront::testing

// SPDX-License-Identifier: Apache-2.0
// What room max_step() leaves for the roundings of a commit, written down once more. Pure functions.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "engine/contact.h"
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

/// Of a pair of this kind; `posed`: by vertex of the pair, of its body.
inline double room_of(ContactKind kind, const FeatureVertices& features, Rounding rounding,
                      const std::array<PosedRounding, 4>& posed = {}) {
  if (kind != ContactKind::kVertexFace && kind != ContactKind::kEdgeEdge) return 0;
  double room = 0;
  for (std::size_t k = 0; k < 4; ++k) {
    const auto& [from, to] = *features.vertex[k];
    double size = 0;
    for (std::size_t axis = 0; axis < 3; ++axis)
      size = std::max({size, std::abs(from[axis]), std::abs(to[axis])});
    if (std::equal(from.begin(), from.begin() + 3, to.begin())) continue;
    const auto& [share, translation] = posed[k];
    room = std::max(room, share > 0 ? share * 3 * translation + share * 2 * size : share_of(rounding) * size);
  }
  return room;
}

/// By a test that is given a separation: what is asked for, or the room where that is more. How surely what is
/// in contact by both is, the former tells; where overlaps at the start are left out, none is that starts within
/// the room alone.
template <class Test>
Verdict with_room(double asked, double room, bool leave_out_overlaps, Test&& test) {
  Verdict verdict = test(std::max(asked, room));
  if (room <= asked || !verdict.contact) return verdict;
  const Verdict without = test(asked);
  if (verdict.status == ContactStatus::kOverlapAtStart) return leave_out_overlaps ? without : verdict;
  if (without.contact) verdict.status = without.status;
  return verdict;
}

}  // namespace warmfront::testing

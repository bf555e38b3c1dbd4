// SPDX-License-Identifier: Apache-2.0
// How far nodes have travelled, so that the front can tell without a test that two of them are still apart.
// Written by refit, read by all threads for the rest of the step.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

#include "engine/bounds/width.h"

namespace warmfront {

/// Where a node has gone, and how much its bounds (or a leaf's vertices) have moved otherwise, added up over
/// all steps. Two nodes whose centres have kept their offset may have moved any way together; how near they
/// have come is at most the change of that offset plus what both have wandered (the lazy front of DESIGN 4,
/// made relative). The centre is that of the bounds; of a leaf with blocks it is the sum over all steps of
/// the middle of its vertices' displacements: less wander from that than from any other.
///
/// Lengths are in the local frame, measured along axes of largest coordinate 1 and first norm at most 2: half
/// of a diagonal slab's displacement counts. `wandered` is in units of 2^-26 and wraps around.
struct NodeTravel {
  std::array<float, 3> centre{};
  std::uint32_t wandered = 0;
};

/// Lengths in units of 2^-26, from above; no single one counts for more than 2^28 of them, which a budget of
/// the same limit does not survive. Until a budget is looked at, both nodes may wander by as much three
/// times: more would wrap around.
namespace travel {

inline constexpr float kUnits = 0x1p26F;
inline constexpr std::uint32_t kMost = 1U << 28;

inline std::uint32_t units(float length) {
  const float scaled = length * kUnits;
  return scaled < static_cast<float>(kMost) ? static_cast<std::uint32_t>(scaled) + 1 : kMost;  // NaN: kMost
}

/// What rounding can hide in one comparison, for each of the two nodes, or in one step's change, for
/// coordinates up to `magnitude` M. With u = 2^-24, the end of a slab lies 18 u M farther out than its
/// vertices at most (point_bounds(); along a diagonal, which counts half) or 10 u M (along x, y, z): of two
/// nodes when the budget was granted and when it is asked for, 40 u M. Centres are up to 2 M, so two
/// differences of them and the difference of these are off by 16 u M. Half of that is less than 2^-19 M =
/// 32 u M. In one step's change a leaf's displacements (up to 2 M), their middle, the sum and half their
/// width are off by 2 u M each.
inline std::uint32_t slack(double magnitude) {
  return magnitude < 0x1p20 ? static_cast<std::uint32_t>(0x1p-19 * magnitude * 0x1p26) + 64 : kMost;
}

/// What a question keeps in hand of every budget: the slack of two nodes together, and its width. A budget
/// may be used up along a diagonal, of whose width half counts.
inline std::uint32_t reserve(std::uint32_t slack_of_two, const Width& width) {
  constexpr std::uint32_t kAll = kMost;  // more than any budget
  const std::uint32_t of_width = width.none() ? 0 : units(std::max(width.straight, 0.5F * width.diagonal));
  return std::min(slack_of_two + of_width, kAll);
}

}  // namespace travel

/// A promise that two nodes do not meet until their motion has used it up; and that they stay a width apart
/// until it has used up all but that.
struct TravelBudget {
  std::array<float, 3> offset{};  ///< between the centres when it was granted
  std::uint32_t expiry = 0;       ///< what both have wandered by then, and the gap on top

  /// `gap`: how far they are apart at t = 1 along an axis as above; not positive: nothing is promised.
  static TravelBudget grant(const NodeTravel& a, const NodeTravel& b, float gap) {
    TravelBudget budget{{a.centre[0] - b.centre[0], a.centre[1] - b.centre[1], a.centre[2] - b.centre[2]},
                        a.wandered + b.wandered};
    if (gap > 0) budget.expiry += std::min(travel::units(gap), travel::kMost) - 1;  // from below
    return budget;
  }

  /// Was it granted where these are? True, too, where the nodes lie as they did then.
  bool granted_at(const NodeTravel& a, const NodeTravel& b) const {
    return offset[0] == a.centre[0] - b.centre[0] && offset[1] == a.centre[1] - b.centre[1] &&
           offset[2] == a.centre[2] - b.centre[2];
  }
  /// So much is used up, besides what nodes will wander.
  void charge(std::uint32_t units) { expiry -= units; }
  /// Nothing is promised any more.
  void spend(const NodeTravel& a, const NodeTravel& b) { *this = grant(a, b, 0); }

  /// Must they be tested again in this step, by a question with this reserve()? The promise holds at the end
  /// of the step, and on the way if it did at the start, since what both have moved apart by is largest at
  /// one of the two.
  bool exhausted(const NodeTravel& a, const NodeTravel& b, std::uint32_t reserve) const {
    const auto left = static_cast<std::int32_t>(expiry - a.wandered - b.wandered);
    const auto usable = static_cast<float>(left - static_cast<std::int32_t>(reserve));
    const auto lasts = [&](int k) {  // false, too, for what is not a number
      return std::fabs((a.centre[k] - b.centre[k]) - offset[k]) * travel::kUnits < usable;
    };
    return !(lasts(0) & lasts(1) & lasts(2));
  }
};

}  // namespace warmfront

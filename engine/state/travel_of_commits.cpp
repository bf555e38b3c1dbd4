// SPDX-License-Identifier: Apache-2.0
// What the hierarchies of parts have travelled once a part of a motion, or none of it, is taken.
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>

#include "engine/motion/commit_room.h"
#include "engine/state/part_trees.h"

namespace warmfront {

// With f in (0, 1) and d and w what a node's points are displaced by, d in common and within w of that: at f
// of the way they are displaced by f d, and within f w <= w of that. So may bounds be, whose ends are convex
// functions of where on the way points are. On an arc they are that much farther from there, at most, and a
// commit rounds, which far from the origin is more than what rounding hides in the local frame. Since the
// base a node counts as having wandered travel::kMost at most: no budget survives that, and sums of more
// would wrap.
template <class Bounds>
void PartTrees<Bounds>::shorten(const Core& core, double fraction, bool beside, Rounding rounding) {
  const auto f = static_cast<float>(fraction);
  const auto shorten_all = [&](std::span<const NodeTravel> base, std::span<NodeTravel> travel,
                               std::uint32_t more) {
    for (std::size_t n = 0; n < travel.size(); ++n) {
      for (int k = 0; k < 3; ++k)
        travel[n].centre[k] = base[n].centre[k] + f * (travel[n].centre[k] - base[n].centre[k]);
      const std::uint32_t wandered = travel[n].wandered - base[n].wandered;
      travel[n].wandered = base[n].wandered + std::min(wandered + more, travel::kMost);
    }
  };
  // Half of a diagonal's displacement counts, which is no more than its length.
  const auto units = [&](double scene_length) {
    const double length = core.motion.vertices().frame().to_local(scene_length);
    return length > 0 ? travel::units(static_cast<float>(std::min(length, 0x1p100) * (1 + 0x1p-20))) : 0U;
  };
  for (std::uint32_t p = 0; p < trees_.size(); ++p) {
    const bool moves = (states_[p] & kMoving) != 0;
    // What goes from pose to pose is rounded, also where both put every vertex where it is.
    if (waits(PartId{p}) || !(moves || core.motion.turns(PartId{p}))) continue;
    TreeTravel& travel = trees_[p].travel;
    const std::uint32_t slack = beside ? std::min(2 * travel.slack, travel::kMost) : travel.slack;
    const std::uint32_t more = slack + units(core.arcs.most_of(PartId{p})) +
                               units(most_commit_room(rounding, core.motion, core.model, PartId{p}));
    if (moves) {
      shorten_all(travel.base_nodes, travel.nodes, more);
      shorten_all(travel.base_blocks, travel.blocks, more);
    } else {
      for (auto* const all : {&travel.nodes, &travel.blocks}) {
        for (NodeTravel& of : *all) of.wandered += std::min(more, travel::kMost);
      }
      bases_[p].left = true;
    }
    refit_in_[p] = step_ - 1;  // bounds at t = 1 are not those of where it is
  }
}

template <class Bounds>
void PartTrees<Bounds>::go_back() {
  for (std::uint32_t p = 0; p < trees_.size(); ++p) {
    if (!waits(PartId{p}) && (states_[p] & kMoving) != 0) refit_in_[p] = step_ - 1;
  }
  return_to_base();
}

template void PartTrees<Aabb>::shorten(const Core&, double, bool, Rounding);
template void PartTrees<Aabb>::go_back();
template void PartTrees<KDop18>::shorten(const Core&, double, bool, Rounding);
template void PartTrees<KDop18>::go_back();

}  // namespace warmfront

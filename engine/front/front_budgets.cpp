// SPDX-License-Identifier: Apache-2.0
// What becomes of the front's budgets where motions begin elsewhere than where they were granted.
#include <cstdint>

#include "engine/front/front.h"

namespace warmfront {

template <class Bounds>
void Front<Bounds>::settle(std::span<const Bvh<Bounds>> trees, const PartWidths& widths) noexcept {
  for (FrontSegment& segment : segments_) {
    const TreePair<Bounds> pair_of(trees[number_of(segment.parts.a)], trees[number_of(segment.parts.b)],
                                   GapAt::kEnd, widths.of(segment.parts));
    const Bvh<Bounds>& a = pair_of.a;
    const Bvh<Bounds>& b = pair_of.b;
    if (a.travel.nodes.empty() || b.travel.nodes.empty()) continue;
    const std::uint32_t reserve = pair_of.reserve();
    for (FrontChunk& chunk : segment.chunks) {
      for (FrontPair& pair : chunk.pairs) {
        const NodeTravel& at_a = a.travel.nodes[number_of(pair.nodes.a)];
        const NodeTravel& at_b = b.travel.nodes[number_of(pair.nodes.b)];
        if (pair.budget.exhausted(at_a, at_b, reserve)) pair.budget.spend(at_a, at_b);
      }
    }
    if (segment.with_itself()) neighbours_.settle(segment.parts.a, a.travel.blocks, reserve);
  }
}

template <class Bounds>
void Front<Bounds>::leave_trial(std::span<const Bvh<Bounds>> trees, std::span<const std::uint8_t> off_base,
                                TrialLeft left, const PartWidths& widths) noexcept {
  for (FrontSegment& segment : segments_) {
    const std::uint32_t p = number_of(segment.parts.a);
    const std::uint32_t q = number_of(segment.parts.b);
    if (off_base[p] == 0 && off_base[q] == 0) continue;
    const TreePair<Bounds> pair_of(trees[p], trees[q], GapAt::kEnd, widths.of(segment.parts));
    if (pair_of.a.travel.nodes.empty() || pair_of.b.travel.nodes.empty()) continue;
    const TrialTravel a = pair_of.a.travel.nodes_of_trial(off_base[p] != 0);
    const TrialTravel b = pair_of.b.travel.nodes_of_trial(off_base[q] != 0);
    const std::uint32_t reserve = pair_of.reserve();
    for (FrontChunk& chunk : segment.chunks) {
      for (FrontPair& pair : chunk.pairs)
        warmfront::leave_trial(pair.budget, a, number_of(pair.nodes.a), b, number_of(pair.nodes.b), left,
                               reserve);
    }
    if (segment.with_itself())
      neighbours_.leave_trial(segment.parts.a, pair_of.a.travel.blocks_of_trial(true), left, reserve);
  }
}

template void Front<Aabb>::settle(std::span<const Bvh<Aabb>>, const PartWidths&) noexcept;
template void Front<Aabb>::leave_trial(std::span<const Bvh<Aabb>>, std::span<const std::uint8_t>, TrialLeft,
                                       const PartWidths&) noexcept;
template void Front<KDop18>::settle(std::span<const Bvh<KDop18>>, const PartWidths&) noexcept;
template void Front<KDop18>::leave_trial(std::span<const Bvh<KDop18>>, std::span<const std::uint8_t>,
                                         TrialLeft, const PartWidths&) noexcept;

}  // namespace warmfront

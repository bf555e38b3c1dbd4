// SPDX-License-Identifier: Apache-2.0
// What stays of the front where a part's hierarchy has changed in some blocks.
#include <algorithm>
#include <cstdint>
#include <vector>

#include "engine/front/front.h"
#include "engine/parallel/stoppable_loops.h"

namespace warmfront {

template <class Bounds>
void Front<Bounds>::follow(PartId part, std::span<const Bvh<Bounds>> trees,
                           std::span<const std::uint8_t> changed_blocks, std::size_t max_bytes,
                           StopSignal stop) {
  const Bvh<Bounds>& tree = trees[number_of(part)];
  const std::vector<std::uint8_t>& holds = tree.motion.renewed;
  // What holds something new is one of these leaves, or above one.
  NodeSet leaves;
  PacedStop paced(stop, 64);
  for (NodeId leaf = tree.shape.first_leaf(); leaf < tree.shape.end_node(); ++leaf) {
    paced.check();
    if (holds[number_of(leaf)] != 0) leaves.add(leaf);
  }
  for (FrontSegment& segment : segments_) {
    paced.check();
    const bool is_a = segment.parts.a == part, is_b = segment.parts.b == part;
    if ((!is_a && !is_b) || segment.chunks.empty()) continue;
    if (is_a && is_b && neighbours_.listed(part) &&
        !neighbours_.follow(part, tree, changed_blocks, max_bytes, stop)) {
      size_ -= segment.size;
      forget(segment);
      continue;
    }
    const auto& travel_a = trees[number_of(segment.parts.a)].travel.nodes;
    const auto& travel_b = trees[number_of(segment.parts.b)].travel.nodes;
    const bool budgets = !travel_a.empty() && !travel_b.empty();
    for (FrontChunk& chunk : segment.chunks) {
      paced.check();
      if (!(is_a && chunk.nodes_a.meets(leaves)) && !(is_b && chunk.nodes_b.meets(leaves))) continue;
      for (FrontPair& pair : chunk.pairs) {
        const auto [a, b] = pair.nodes;
        if (!(is_a && holds[number_of(a)] != 0) && !(is_b && holds[number_of(b)] != 0)) continue;
        pair.budget =
            budgets ? TravelBudget::grant(travel_a[number_of(a)], travel_b[number_of(b)], 0) : TravelBudget{};
        pair.adjacent = false;
        pair.neighbours = 0;
      }
    }
  }
}

template void Front<Aabb>::follow(PartId, std::span<const Bvh<Aabb>>, std::span<const std::uint8_t>,
                                  std::size_t, StopSignal);
template void Front<KDop18>::follow(PartId, std::span<const Bvh<KDop18>>, std::span<const std::uint8_t>,
                                    std::size_t, StopSignal);

}  // namespace warmfront

// SPDX-License-Identifier: Apache-2.0
// How far a hierarchy's nodes and blocks have travelled. Written by refit.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "engine/bounds/moving.h"
#include "engine/bvh/travel.h"
#include "engine/scene.h"
#include "engine/scene/held_bytes.h"

namespace warmfront {

/// All empty where no front keeps budgets.
struct TreeTravel {
  std::vector<NodeTravel> nodes;   ///< by NodeId
  std::vector<NodeTravel> blocks;  ///< by block of a wide leaf, as a leaf's
  /// Both at the base that trials begin from, while there are trials; else of no use.
  std::vector<NodeTravel> base_nodes, base_blocks;
  Csr block_vertices;       ///< by block, each once; no rows where there are no blocks
  std::uint32_t slack = 0;  ///< what rounding can hide of a node's travel, in its units

  /// At an end of the last motion; kStart: of a trial.
  std::span<const NodeTravel> nodes_at(GapAt end) const { return end == GapAt::kEnd ? nodes : base_nodes; }
  std::span<const NodeTravel> blocks_at(GapAt end) const { return end == GapAt::kEnd ? blocks : base_blocks; }

  std::size_t memory_bytes() const {
    return held_bytes(nodes, blocks, base_nodes, base_blocks) + block_vertices.memory_bytes();
  }
};

}  // namespace warmfront

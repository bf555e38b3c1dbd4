// SPDX-License-Identifier: Apache-2.0
// What a hierarchy holds below its leaves: blocks of eight primitives. Written by Bvh::arrange() and refit.
#pragma once

#include <cstddef>
#include <memory>
#include <vector>

#include "engine/bvh/eight_bounds.h"
#include "engine/bvh/leaf_grid.h"
#include "engine/bvh/shared_vertices.h"
#include "engine/bvh/tree_shape.h"
#include "engine/parallel/unwritten_list.h"
#include "engine/scene/held_bytes.h"

namespace warmfront {

/// All empty for leaves of one primitive, whose node says it all.
template <class Bounds>
struct LeafContents {
  std::vector<BlockRange> blocks_of;             ///< by leaf, as the shape says
  std::vector<LeafGrid<Bounds>> grids;           ///< by leaf: what the numbers of its blocks are in
  UnwrittenList<EightBounds<Bounds>> wide;       ///< by leaf, of its blocks; empty where each has one
  UnwrittenList<EightBounds<Bounds>> blocks;     ///< by block, of its primitives
  UnwrittenList<EightCorners> corners;           ///< by block
  std::shared_ptr<const SharedVertices> shared;  ///< of the blocks; null where it is computed when asked

  std::size_t memory_bytes() const {
    return held_bytes(blocks_of, grids, wide, blocks, corners) +
           (shared.use_count() == 1 ? shared->memory_bytes() : 0);
  }
};

}  // namespace warmfront

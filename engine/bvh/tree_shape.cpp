// SPDX-License-Identifier: Apache-2.0
#include "engine/bvh/tree_shape.h"

namespace warmfront {
namespace {

std::uint32_t shares(std::uint32_t count, std::uint32_t most) {
  return count / most + (count % most != 0);
}

}  // namespace

TreeShape::TreeShape(std::uint32_t primitive_count, std::uint32_t leaf_size)
    : primitives_(primitive_count),
      leaf_size_(leaf_size),
      blocks_(std::max(1U, shares(primitive_count, std::min(leaf_size, kBlockSize)))),
      leaves_(shares(blocks_, std::max(1U, leaf_size / kBlockSize))),
      largest_block_(shares(primitive_count, blocks_)),
      depth_(std::bit_width(leaves_ - 1)) {}

}  // namespace warmfront

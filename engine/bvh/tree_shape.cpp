// SPDX-License-Identifier: Apache-2.0
#include "engine/bvh/tree_shape.h"

#include <utility>

namespace warmfront {
namespace {

std::uint32_t shares(std::uint32_t count, std::uint32_t most) {
  return count / most + (count % most != 0);
}

}  // namespace

TreeShape::TreeShape(std::uint32_t primitive_count, std::uint32_t leaf_size, std::uint32_t of_block)
    : primitives_(primitive_count),
      leaf_size_(leaf_size),
      of_block_(of_block),
      blocks_(std::max(1U, shares(primitive_count, of_block))),
      leaves_(shares(blocks_, std::max(1U, leaf_size / kBlockSize))),
      largest_block_(shares(primitive_count, blocks_)),
      depth_(std::bit_width(leaves_ - 1)) {}

TreeShape TreeShape::with_blocks(std::vector<std::uint32_t> begins) const {
  TreeShape result = *this;
  result.primitives_ = begins.back();
  result.largest_block_ = 0;
  for (std::uint32_t b = 0; b < blocks_; ++b)
    result.largest_block_ = std::max(result.largest_block_, begins[b + 1] - begins[b]);
  result.begins_ = std::make_shared<const std::vector<std::uint32_t>>(std::move(begins));
  return result;
}

}  // namespace warmfront

// SPDX-License-Identifier: Apache-2.0
// The shape of a hierarchy: which nodes, leaves, blocks and primitives there are, and what is below what.
// Pure values.
#pragma once

#include <algorithm>
#include <bit>
#include <cstdint>
#include <memory>
#include <vector>

#include "engine/bvh/tree_numbers.h"

namespace warmfront {

/// The shape of the hierarchy: a complete binary tree, numbered by levels, whose leaves are as full as they
/// can be. Its last level is filled from the left, so leaves lie on one level or two, and a node's number
/// says it all: children of i are 2i + 1 and 2i + 2, smaller numbers lie nearer the root, and a node is a
/// leaf when its number is at least first_leaf(). P primitives are B blocks of at most eight, and these L
/// leaves: counted from left to right, leaf k holds blocks [k B / L, (k + 1) B / L), and block b the
/// primitives in positions [b P / B, (b + 1) P / B) of `order`, unless it says otherwise (with_blocks()).
/// None is empty unless all are.
class TreeShape {
 public:
  static constexpr std::uint32_t kBlockSize = 8;

  TreeShape() = default;
  /// `leaf_size`: primitives in a leaf at most; a power of two, 64 at most.
  TreeShape(std::uint32_t primitive_count, std::uint32_t leaf_size)
      : TreeShape(primitive_count, leaf_size, most_of_block(leaf_size)) {}
  /// The same, where some are to be added for which this shape had no room: with one place more of each block
  /// left empty, but no more than a quarter of it.
  TreeShape with_more_room(std::uint32_t primitive_count) const {
    const std::uint32_t most = most_of_block(leaf_size_);
    return {primitive_count, leaf_size_, std::max(of_block_ - 1, most - most / 4)};
  }
  /// The same nodes, leaves and blocks, of which block b holds the primitives in positions [begins[b],
  /// begins[b + 1]): one at least, and most_of_block() at most.
  TreeShape with_blocks(std::vector<std::uint32_t> begins) const;
  static std::uint32_t most_of_block(std::uint32_t leaf_size) { return std::min(leaf_size, kBlockSize); }

  std::uint32_t primitive_count() const { return primitives_; }
  std::uint32_t leaf_size() const { return leaf_size_; }
  int levels() const { return depth_ + 1; }
  std::uint32_t node_count() const { return 2 * leaves_ - 1; }
  std::uint32_t leaf_count() const { return leaves_; }
  std::uint32_t block_count() const { return blocks_; }
  bool has_wide_leaves() const { return leaf_size_ > kBlockSize; }
  NodeId first_leaf() const { return NodeId{leaves_ - 1}; }
  NodeId end_node() const { return NodeId{node_count()}; }  ///< after the last, which is a leaf
  bool is_leaf(NodeId node) const { return node >= first_leaf(); }
  LeafId leaf_of(NodeId node) const { return LeafId{node - first_leaf()}; }  ///< the node is_leaf()
  NodeId node_of(LeafId leaf) const { return first_leaf() + number_of(leaf); }
  LeafId end_leaf() const { return LeafId{leaf_count()}; }  ///< after the last
  /// Position in `order` where the primitives of a block begin; those of the last end where one more would.
  std::uint32_t begin_of_block(BlockId block) const {
    const std::uint32_t b = number_of(block);
    return begins_ != nullptr ? (*begins_)[b] : share(b, primitives_, blocks_);
  }
  /// So many primitives hold the largest of the blocks; unless with_blocks() said otherwise, the others one
  /// less.
  std::uint32_t largest_block() const { return largest_block_; }
  std::uint32_t size_of_block(BlockId block) const {
    return begin_of_block(block + 1) - begin_of_block(block);
  }
  /// Where the blocks below `node` begin, and where they end.
  BlockId first_block(NodeId node) const { return first_block(level_of(node), index_of(node)); }
  BlockId end_block(NodeId node) const { return first_block(level_of(node), index_of(node) + 1); }
  BlockId end_block() const { return BlockId{blocks_}; }  ///< after the last
  /// Position in `order` where the primitives below `node` begin, and where they end.
  std::uint32_t begin(NodeId node) const { return begin_of_block(first_block(node)); }
  std::uint32_t end(NodeId node) const { return begin_of_block(end_block(node)); }

  /// The subtrees that are worked on as a whole, each by one task: those that root on this level, above which
  /// there are no leaves. What a task has made of one, up to some 500 KB for a million primitives, it finds
  /// in the nearer caches when it looks at it again.
  int subtree_level() const {
    // A small hierarchy is one task: there are many more of its kind. A larger one is shared.
    if (primitives_ <= 1024) return 0;
    const auto log2 = [](std::uint32_t x) { return static_cast<int>(std::bit_width(x)) - 1; };
    const int level = std::max(std::min(log2(primitives_ / 256), 4), log2(primitives_ / 512));
    return std::min(level, 8);
  }
  std::uint32_t subtree_count() const { return 1U << subtree_level(); }
  NodeId subtree_root(std::uint32_t subtree) const { return first_of_level(subtree_level()) + subtree; }
  /// The subtree that a node is in, which is not above them; counted from the left.
  std::uint32_t subtree_of(NodeId node) const { return index_of(node) >> (level_of(node) - subtree_level()); }

  static int level_of(NodeId node) { return std::bit_width(number_of(node) + 1) - 1; }
  static NodeId first_of_level(int level) { return NodeId{(1U << level) - 1}; }
  static NodeId left(NodeId node) { return NodeId{2 * number_of(node) + 1}; }
  static NodeId right(NodeId node) { return left(node) + 1; }
  static NodeId parent(NodeId node) { return NodeId{(number_of(node) - 1) / 2}; }
  static bool is_left(NodeId node) { return (number_of(node) & 1U) != 0; }

  std::size_t memory_bytes() const {  ///< besides its own
    return begins_ != nullptr ? begins_->capacity() * sizeof(std::uint32_t) : 0;
  }

 private:
  TreeShape(std::uint32_t primitive_count, std::uint32_t leaf_size, std::uint32_t of_block);

  static std::uint32_t index_of(NodeId node) { return node - first_of_level(level_of(node)); }
  static std::uint32_t share(std::uint32_t i, std::uint32_t of, std::uint32_t among) {
    return static_cast<std::uint32_t>(std::uint64_t{i} * of / among);
  }
  // From the leaves left of node `index` of `level`: counted on the last level, where beyond its end every
  // two stand for one of the level above.
  BlockId first_block(int level, std::uint32_t index) const {
    const std::uint32_t last = index << (depth_ - level);
    const std::uint32_t filled = 2 * leaves_ - (1U << depth_);
    return BlockId{share(last <= filled ? last : filled + (last - filled) / 2, blocks_, leaves_)};
  }

  std::uint32_t primitives_ = 0;
  std::uint32_t leaf_size_ = 1;
  std::uint32_t of_block_ = 1;  // at most, unless with_blocks() said otherwise
  std::uint32_t blocks_ = 1;
  std::uint32_t leaves_ = 1;
  std::uint32_t largest_block_ = 0;
  int depth_ = 0;                                             // of the last level
  std::shared_ptr<const std::vector<std::uint32_t>> begins_;  // null: as shared out
};

/// Blocks one after another.
struct BlockRange {
  BlockId begin;
  BlockId end;

  std::uint32_t size() const { return end - begin; }
  bool operator==(const BlockRange&) const = default;
};

}  // namespace warmfront

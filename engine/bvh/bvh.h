// SPDX-License-Identifier: Apache-2.0
// The bounding volume hierarchy over a scene's primitives: a complete binary tree laid out by levels.
// Written by build and refit; a subtree, once it is refit, is read by all threads for the rest of the step.
#pragma once

#include <algorithm>
#include <bit>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "engine/bounds/kdop.h"
#include "engine/bounds/moving.h"
#include "engine/bounds/overlap.h"
#include "engine/bvh/eight_bounds.h"
#include "engine/bvh/leaf_grid.h"
#include "engine/bvh/node_set.h"
#include "engine/bvh/shared_vertices.h"
#include "engine/bvh/travel.h"
#include "engine/motion/motion.h"
#include "engine/scene.h"
#include "engine/scene/held_bytes.h"
#include "engine/stop.h"

namespace warmfront {

/// The shape of the hierarchy: a complete binary tree, numbered by levels, whose leaves are as full as they
/// can be. Its last level is filled from the left, so leaves lie on one level or two, and a node's number
/// says it all: children of i are 2i + 1 and 2i + 2, smaller numbers lie nearer the root, and a node is a
/// leaf when its number is at least first_leaf(). P primitives are B blocks of at most eight, and these L
/// leaves: counted from left to right, leaf k holds blocks [k B / L, (k + 1) B / L), and block b the
/// primitives in positions [b P / B, (b + 1) P / B) of `order`. None is empty unless all are.
class TreeShape {
 public:
  static constexpr std::uint32_t kBlockSize = 8;

  TreeShape() = default;
  /// `leaf_size`: primitives in a leaf at most; a power of two, 64 at most.
  TreeShape(std::uint32_t primitive_count, std::uint32_t leaf_size);

  std::uint32_t primitive_count() const { return primitives_; }
  std::uint32_t leaf_size() const { return leaf_size_; }
  int levels() const { return depth_ + 1; }
  std::uint32_t node_count() const { return 2 * leaves_ - 1; }
  std::uint32_t leaf_count() const { return leaves_; }
  std::uint32_t block_count() const { return blocks_; }
  bool has_wide_leaves() const { return leaf_size_ > kBlockSize; }
  NodeId first_leaf() const { return leaves_ - 1; }
  bool is_leaf(NodeId node) const { return node >= first_leaf(); }
  /// Position in `order` where the primitives of a block begin; those of the last end where one more would.
  std::uint32_t begin_of_block(std::uint32_t block) const { return share(block, primitives_, blocks_); }
  /// So many primitives hold the largest of the blocks; the others one less.
  std::uint32_t largest_block() const { return largest_block_; }
  std::uint32_t size_of_block(std::uint32_t block) const {
    return begin_of_block(block + 1) - begin_of_block(block);
  }
  /// Where the blocks below `node` begin, and where they end.
  std::uint32_t first_block(NodeId node) const { return first_block(level_of(node), index_of(node)); }
  std::uint32_t end_block(NodeId node) const { return first_block(level_of(node), index_of(node) + 1); }
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
  NodeId subtree_root(std::uint32_t subtree) const { return (1U << subtree_level()) - 1 + subtree; }
  /// The subtree that a node is in, which is not above them; counted from the left.
  std::uint32_t subtree_of(NodeId node) const { return index_of(node) >> (level_of(node) - subtree_level()); }

  static int level_of(NodeId node) { return std::bit_width(node + 1) - 1; }
  static NodeId left(NodeId node) { return 2 * node + 1; }
  static NodeId parent(NodeId node) { return (node - 1) / 2; }
  static bool is_left(NodeId node) { return (node & 1U) != 0; }

 private:
  static std::uint32_t index_of(NodeId node) { return node + 1 - (1U << level_of(node)); }
  static std::uint32_t share(std::uint32_t i, std::uint32_t of, std::uint32_t among) {
    return static_cast<std::uint32_t>(std::uint64_t{i} * of / among);
  }
  // From the leaves left of node `index` of `level`: counted on the last level, where beyond its end every
  // two stand for one of the level above.
  std::uint32_t first_block(int level, std::uint32_t index) const {
    const std::uint32_t last = index << (depth_ - level);
    const std::uint32_t filled = 2 * leaves_ - (1U << depth_);
    return share(last <= filled ? last : filled + (last - filled) / 2, blocks_, leaves_);
  }

  std::uint32_t primitives_ = 0;
  std::uint32_t leaf_size_ = 1;
  std::uint32_t blocks_ = 1;
  std::uint32_t leaves_ = 1;
  std::uint32_t largest_block_ = 0;
  int depth_ = 0;  // of the last level
};

/// Blocks one after another, by their numbers.
struct BlockRange {
  std::uint32_t begin;
  std::uint32_t end;

  std::uint32_t size() const { return end - begin; }
  bool operator==(const BlockRange&) const = default;
};

/// A hierarchy over some of a scene's primitives, with bounds of one kind.
template <class Bounds>
struct Bvh {
  /// The pairs of primitives of two blocks that are not to be tested against each other, as
  /// SharedVertices::of() says; of crowded blocks, too, all of them.
  std::uint64_t excluded(std::uint32_t a, std::uint32_t b) const {
    return is_known(a, b) ? shared->of(a, b) : look_for_excluded(a, b);
  }
  /// The same of two of which SharedVertices::has_place() is false.
  std::uint64_t excluded_if_not_listed(std::uint32_t a, std::uint32_t b) const {
    return is_known(a, b) ? shared->of_no_place(a, b) : look_for_excluded(a, b);
  }
  /// The travel of nodes, or of blocks, at an end of the last motion; kStart: of a trial.
  std::span<const NodeTravel> travel_at(GapAt end) const { return end == GapAt::kEnd ? travel : base_travel; }
  std::span<const NodeTravel> block_travel_at(GapAt end) const {
    return end == GapAt::kEnd ? block_travel : base_block_travel;
  }
  /// Of two blocks, as warmfront::no_pairs() says.
  std::uint64_t no_pairs(std::uint32_t a, std::uint32_t b) const {
    return warmfront::no_pairs(shape.size_of_block(a), shape.size_of_block(b), a == b);
  }

  /// Did any node of the subtree change in the last refit?
  bool subtree_changed(std::uint32_t subtree) const {
    return (states[shape.subtree_root(subtree)] & kChanged) != 0;
  }

  TreeShape shape;
  std::vector<Primitive> order;       ///< primitive at each position
  std::vector<Bounds> nodes;          ///< by NodeId
  std::vector<BlockRange> blocks_of;  ///< by leaf, as the shape says; empty where `blocks` is
  /// Of its primitives, by block. Empty for leaves of one primitive, whose node says it all.
  std::vector<EightBounds<Bounds>> blocks;
  std::vector<EightCorners> corners;             ///< by block
  std::shared_ptr<const SharedVertices> shared;  ///< of `blocks`; null where it is looked for when asked
  std::vector<EightBounds<Bounds>> wide;         ///< by leaf, of its blocks; empty where each has one
  std::vector<LeafGrid<Bounds>> grids;           ///< by leaf, of its blocks' numbers; empty where `blocks` is
  std::vector<NodeTravel> travel;                ///< by NodeId; empty when nobody asks
  /// Both of the base that trials begin from, while there are trials; else of no use.
  std::vector<NodeTravel> base_travel, base_block_travel;
  std::vector<NodeTravel> block_travel;  ///< by block of a wide leaf, as a leaf's; empty where `travel` is
  Csr block_vertices;                    ///< by block, each once; no rows where `travel` or `blocks` is empty
  std::uint32_t travel_slack = 0;        ///< what rounding can hide of a node's travel, in its units
  double built_looseness = 0;            ///< looseness() after the first refit; 0 before it
  std::vector<MotionState> states;       ///< by NodeId: union over the vertices below
  NodeSet changed;                       ///< nodes whose state has kChanged
  bool all_moving = false;               ///< every node's state is kMoving and kChanged
  std::vector<std::uint32_t> leaf_of_face;  ///< NodeId by face, from first_face on
  std::uint32_t first_face = 0;

  /// Takes a shape and an order of primitives, whose faces are a range, and what is known of these; bounds
  /// are undefined until a refit of all, travel starts anew if it is to be kept. Throws Stopped when told to
  /// stop, as all below do; what it has in hand is good for nothing but another arrange() then.
  void arrange(const Scene& scene, const TreeShape& new_shape, std::vector<Primitive> new_order,
               std::shared_ptr<const SharedVertices> new_shared, bool keep_travel, StopSignal stop = {});

  std::size_t memory_bytes() const {
    return held_bytes(order, nodes, blocks_of, blocks, corners, wide, grids, travel, base_travel,
                      base_block_travel, block_travel, states, leaf_of_face) +
           (shared.use_count() == 1 ? shared->memory_bytes() : 0) + block_vertices.memory_bytes();
  }

 private:
  void list_block_vertices(const Scene& scene, StopSignal stop);

  bool is_known(std::uint32_t a, std::uint32_t b) const {
    return shared != nullptr && !(shared->crowded(a) && shared->crowded(b));
  }
  std::uint64_t look_for_excluded(std::uint32_t a, std::uint32_t b) const {
    const std::uint64_t sharing = sharing_pairs(corners[a], corners[b]);
    return sharing != 0 ? sharing | no_pairs(a, b) : 0;
  }
};

/// What `Bvh::shared` is of a hierarchy of this shape and order.
std::shared_ptr<const SharedVertices> shared_vertices(const Scene& scene, const TreeShape& shape,
                                                      std::span<const Primitive> order, StopSignal stop = {});

/// The vertices of a primitive; an isolated vertex stands three times.
Face primitive_vertices(const Scene& scene, Primitive primitive);

/// Orders primitives by object-median splits along the widest axis of their centroids at t = 1. While a node
/// holds more than one body (or component), whole bodies are sorted by their own centroids, so that few nodes
/// mix bodies, which move apart. Parallel inside Workers::run(); the result does not depend on the number of
/// threads. O(P log P).
std::vector<Primitive> build_order(const Scene& scene, const Motion& motion, const TreeShape& shape,
                                   std::span<const Primitive> primitives, StopSignal stop = {});

/// How loose the hierarchy is: the sum of all nodes' extents over the root's. It grows as primitives that
/// were neighbours at the build move apart; a rebuild pays when it has doubled.
template <class Bounds>
double looseness(const Bvh<Bounds>& bvh);

}  // namespace warmfront

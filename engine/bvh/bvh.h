// SPDX-License-Identifier: Apache-2.0
// The bounding volume hierarchy over a scene's primitives: a complete binary tree laid out by levels.
// Written by arrange() and refit; a subtree, once it is refit, is read by all threads for the rest of the
// step.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "engine/bounds/kdop.h"
#include "engine/bounds/moving.h"
#include "engine/bounds/overlap.h"
#include "engine/bvh/leaf_contents.h"
#include "engine/bvh/tree_motion.h"
#include "engine/bvh/tree_shape.h"
#include "engine/bvh/tree_travel.h"
#include "engine/parallel/unwritten_list.h"
#include "engine/scene.h"
#include "engine/scene/held_bytes.h"
#include "engine/scene/primitives.h"
#include "engine/stop.h"

namespace warmfront {

/// The leaf that each face, or each lone edge, of a hierarchy is in, from the first one on: faces are a
/// range, and lone edges among the edges of one.
template <Number Id>
struct LeavesOf {
  std::vector<NodeId> leaf;
  Id first{0};

  NodeId of(Id id) const { return leaf[id - first]; }
};

/// A hierarchy over some of a scene's primitives, with bounds of one kind.
template <class Bounds>
struct Bvh {
  TreeShape shape;
  UnwrittenList<Primitive> order;  ///< primitive at each position
  UnwrittenList<Bounds> nodes;     ///< by NodeId
  LeafContents<Bounds> leaves;
  LeavesOf<NewFace> face_leaves;
  LeavesOf<EdgeId> segment_leaves;
  std::vector<std::uint32_t> patches;  ///< node_patches() of the filters
  TreeMotion motion;
  TreeTravel travel;
  double built_looseness = 0;  ///< looseness() after the first refit; 0 before it

  /// Takes a shape and an order of primitives, whose faces are a range, and what is known of these; bounds
  /// are undefined until a refit of all, travel starts anew if it is to be kept. Throws Stopped when told to
  /// stop, as all below do; what it has in hand is good for nothing but another arrange() then.
  void arrange(const Scene& scene, const TreeShape& new_shape, std::span<const Primitive> new_order,
               std::shared_ptr<const SharedVertices> new_shared, bool keep_travel, StopSignal stop = {});

  /// Takes another order of primitives in the same nodes, leaves and blocks, and vertices with the same
  /// numbers: only these blocks hold something else, or in other slots. What holds one of them is marked in
  /// motion.renewed, and its bounds are undefined until a refit; other bounds are what they were. Travel is
  /// kept, of what holds a changed block as of what it held before.
  void change(const Scene& scene, const TreeShape& new_shape, std::span<const Primitive> new_order,
              std::shared_ptr<const SharedVertices> new_shared, std::span<const std::uint8_t> changed_blocks,
              StopSignal stop = {});

  /// All numbers of the scene that it holds begin elsewhere from now on; nothing else has changed.
  void shift(const NumberShift& by) noexcept;

  /// The pairs of primitives of two blocks that are not to be tested against each other, as
  /// SharedVertices::of() says; of crowded blocks, too, all of them.
  std::uint64_t excluded(BlockId a, BlockId b) const {
    return is_known(a, b) ? leaves.shared->of(a, b) : look_for_excluded(a, b);
  }
  /// The same of two of which SharedVertices::has_place() is false.
  std::uint64_t excluded_if_not_listed(BlockId a, BlockId b) const {
    return is_known(a, b) ? leaves.shared->of_no_place(a, b) : look_for_excluded(a, b);
  }
  /// Of two blocks, as warmfront::no_pairs() says.
  std::uint64_t no_pairs(BlockId a, BlockId b) const {
    return warmfront::no_pairs(shape.size_of_block(a), shape.size_of_block(b), a == b);
  }
  /// Did any node of the subtree change in the last refit?
  bool subtree_changed(std::uint32_t subtree) const {
    return (motion.states[number_of(shape.subtree_root(subtree))] & kChanged) != 0;
  }

  std::size_t memory_bytes() const {
    return held_bytes(order, nodes, face_leaves.leaf, segment_leaves.leaf, patches, motion.states,
                      motion.renewed, motion.arrived) +
           leaves.memory_bytes() + travel.memory_bytes();
  }

 private:
  void list_corners(const Scene& scene, BlockId block);
  // What was listed before, of which leaves that hold the same stay.
  struct Listed {
    const TreeShape& shape;
    std::span<const Primitive> order;
  };
  void list_leaves(const Listed* before, StopSignal stop);

  bool is_known(BlockId a, BlockId b) const {
    return leaves.shared != nullptr && !(leaves.shared->crowded(a) && leaves.shared->crowded(b));
  }
  std::uint64_t look_for_excluded(BlockId a, BlockId b) const {
    const std::uint64_t sharing = sharing_pairs(leaves.corners[number_of(a)], leaves.corners[number_of(b)]);
    return sharing != 0 ? sharing | no_pairs(a, b) : 0;
  }
};

/// How loose the hierarchy is: the sum of all nodes' extents over the root's. It grows as primitives that
/// were neighbours at the build move apart; a rebuild pays when it has doubled. In parallel, unless `alone`,
/// with the same result: outside of Workers::run() only so.
template <class Bounds>
double looseness(const Bvh<Bounds>& bvh, bool alone = false);

}  // namespace warmfront

// SPDX-License-Identifier: Apache-2.0
#include "engine/check/check_hierarchy.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "engine/bounds/moving.h"
#include "engine/bvh/node_patches.h"
#include "engine/scene/primitives.h"

namespace warmfront {
namespace {

template <class Bounds>
bool holds(const Bounds& outer, const Bounds& inner) {
  bool all = true;
  for (std::size_t k = 0; k < outer.lane.size(); ++k) all &= outer.lane[k] <= inner.lane[k];
  return all;
}

}  // namespace

template <class Bounds>
bool HierarchyCheck<Bounds>::holds_each_once() const {
  if (tree_.order.size() != part_.order.size() || tree_.nodes.size() != tree_.shape.node_count() ||
      tree_.shape.primitive_count() != part_.shape.primitive_count() ||
      tree_.shape.leaf_count() != part_.shape.leaf_count())
    return false;
  // At first this is the hierarchy's own order, later always a permutation of it.
  if (std::ranges::equal(tree_.order, part_.order)) return true;
  std::vector<Primitive> order(tree_.order.begin(), tree_.order.end()), first(part_.order);
  PacedStop paced(stop_);
  const auto less = [&](Primitive a, Primitive b) {
    paced.check();
    return a < b;
  };
  std::ranges::sort(order, less);
  std::ranges::sort(first, less);
  return order == first;
}

template <class Bounds>
bool HierarchyCheck<Bounds>::patches_agree() const {
  return tree_.patches ==
         node_patches(core_.topology->scene, tree_.shape, tree_.order, core_.filter.patches(), stop_);
}

template <class Bounds>
bool HierarchyCheck<Bounds>::leaves_agree() const {
  const TreeShape& shape = tree_.shape;
  if (!tree_.leaves.blocks.empty() && (tree_.leaves.blocks.size() != shape.block_count() ||
                                       tree_.leaves.corners.size() != shape.block_count() ||
                                       tree_.leaves.grids.size() != shape.leaf_count() ||
                                       tree_.leaves.blocks_of.size() != shape.leaf_count()))
    return false;
  if (!tree_.leaves.wide.empty() && tree_.leaves.wide.size() != shape.leaf_count()) return false;
  PacedStop paced(stop_, kAtOnce);
  for (NodeId leaf = shape.first_leaf(); leaf < shape.end_node(); ++leaf) {
    paced.check();
    for (std::uint32_t i = shape.begin(leaf); i < shape.end(leaf); ++i) {
      const Primitive p = tree_.order[i];
      const auto lists_leaf = [leaf](const auto& leaves, auto id) {
        const std::uint32_t at = id - leaves.first;
        return at < leaves.leaf.size() && leaves.leaf[at] == leaf;
      };
      if (is_face(p) && !lists_leaf(tree_.face_leaves, NewFace{face_number(p)})) return false;
      if (is_segment(p) && !lists_leaf(tree_.segment_leaves, edge_id(p))) return false;
    }
    if (!tree_.leaves.blocks.empty() && !blocks_agree(leaf)) return false;
  }
  return tree_.leaves.shared == nullptr ||
         *tree_.leaves.shared == *shared_vertices(core_.topology->scene, shape, tree_.order, stop_);
}

template <class Bounds>
bool HierarchyCheck<Bounds>::blocks_agree(NodeId leaf) const {
  const BlockRange blocks{tree_.shape.first_block(leaf), tree_.shape.end_block(leaf)};
  const std::uint32_t l = number_of(tree_.shape.leaf_of(leaf));
  if (tree_.leaves.grids[l].begin_at_1 != 0 && tree_.leaves.grids[l].begin_at_1 != Bounds::kAxes)
    return false;
  if (!(tree_.leaves.blocks_of[l] == blocks)) return false;
  for (BlockId block = blocks.begin; block < blocks.end; ++block) {
    const std::uint32_t begin = tree_.shape.begin_of_block(block);
    const std::uint32_t size = tree_.shape.size_of_block(block);
    for (std::uint32_t i = 0; i < EightBounds<Bounds>::kSlots; ++i) {
      const Face vertices =
          primitive_vertices(core_.topology->scene, tree_.order[begin + (i < size ? i : 0)]);
      for (std::size_t k = 0; k < 3; ++k)
        if (tree_.leaves.corners[number_of(block)].vertex[k][i] != vertices[k]) return false;
    }
  }
  return true;
}

template <class Bounds>
bool HierarchyCheck<Bounds>::node_holds(NodeId node) const {
  const Bounds& bounds = tree_.nodes[number_of(node)];
  if (!tree_.shape.is_leaf(node)) {
    return holds(bounds, tree_.nodes[number_of(TreeShape::left(node))]) &&
           holds(bounds, tree_.nodes[number_of(TreeShape::right(node))]);
  }
  const auto holds_primitive = [&](std::uint32_t position, auto&& holds_bounds) {
    const Face vertices = primitive_vertices(core_.topology->scene, tree_.order[position]);
    return std::ranges::all_of(vertices, [&](std::uint32_t v) {
      const Bounds inner = narrow<Bounds>(bounds_of(core_.vertex_bounds[v]));
      return holds(bounds, inner) && holds_bounds(inner);
    });
  };
  if (tree_.leaves.blocks.empty())
    return holds_primitive(tree_.shape.begin(node), [](const Bounds&) { return true; });
  const std::uint32_t leaf = number_of(tree_.shape.leaf_of(node));
  const BlockRange blocks = tree_.leaves.blocks_of[leaf];
  const LeafGrid<Bounds>& grid = tree_.leaves.grids[leaf];
  LeafGrid<Bounds> own;
  own.set(bounds, 0);
  own.set(bounds, 1);
  if (!(own == grid)) return false;
  for (BlockId block = blocks.begin; block < blocks.end; ++block) {
    const std::uint32_t begin = tree_.shape.begin_of_block(block);
    const std::uint32_t size = tree_.shape.size_of_block(block);
    for (std::uint32_t i = 0; i < EightBounds<Bounds>::kSlots; ++i) {
      const bool held = holds_primitive(begin + (i < size ? i : 0), [&](const Bounds& inner) {
        return holds_numbers(grid, tree_.leaves.blocks[number_of(block)], i, inner) &&
               (tree_.leaves.wide.empty() ||
                holds_numbers(grid, tree_.leaves.wide[leaf], block - blocks.begin, inner));
      });
      if (!held) return false;
    }
  }
  return true;
}

template <class Bounds>
bool HierarchyCheck<Bounds>::holds_numbers(const LeafGrid<Bounds>& grid, const EightBounds<Bounds>& eight,
                                           std::uint32_t slot, const Bounds& inner) {
  constexpr std::size_t kAxes = Bounds::kAxes;
  for (std::size_t t = 0; t < 2; ++t) {
    const auto& end = grid.end[t];
    const double unit = std::ldexp(1.0, end.exponent);
    for (std::size_t k = 0; k < kAxes; ++k) {
      const std::int16_t* number = OneOfLeaf::of(eight, grid.begin_at_1, slot)(t, k);
      const float* lower = &inner.lane[t * Bounds::kEnd + k];
      if (end.none() ? number[0] != grid.kNever || number[1] != grid.kNever
                     : !(end.origin[k] + number[0] * unit <= lower[0]) ||
                           !(number[1] * unit - end.origin[k] <= lower[kAxes]))
        return false;
    }
  }
  return true;
}

template class HierarchyCheck<Aabb>;
template class HierarchyCheck<KDop18>;

}  // namespace warmfront

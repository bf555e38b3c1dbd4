// SPDX-License-Identifier: Apache-2.0
#include <tbb/parallel_for.h>

#include <algorithm>

#include "engine/bvh/bvh.h"

namespace warmfront {
namespace {

template <class Bounds>
void refit_leaf(const Scene& scene, std::span<const KDop18> vertex_bounds, Bvh<Bounds>& bvh, NodeId leaf) {
  Bounds node = Bounds::empty();
  const std::uint32_t end = bvh.shape.begin_of_leaf(leaf + 1);
  for (std::uint32_t i = bvh.shape.begin_of_leaf(leaf); i < end; ++i) {
    const Face vertices = primitive_vertices(scene, bvh.order[i]);
    Bounds primitive = narrow<Bounds>(vertex_bounds[vertices[0]]);
    primitive.merge(narrow<Bounds>(vertex_bounds[vertices[1]]));
    primitive.merge(narrow<Bounds>(vertex_bounds[vertices[2]]));
    if (!bvh.leaves.empty())
      bvh.leaves[leaf - bvh.shape.first_leaf()].set(i - bvh.shape.begin_of_leaf(leaf), primitive);
    node.merge(primitive);
  }
  bvh.nodes[leaf] = node;
}

template <class Bounds>
void refit_inner(Bvh<Bounds>& bvh, NodeId node) {
  Bounds merged = bvh.nodes[TreeShape::left(node)];
  merged.merge(bvh.nodes[TreeShape::left(node) + 1]);
  bvh.nodes[node] = merged;
}

}  // namespace

template <class Bounds>
void refit(const Scene& scene, std::span<const KDop18> vertex_bounds, Bvh<Bounds>& bvh) {
  if (bvh.shape.primitive_count() == 0) return;
  // Subtrees that root on one level are refit side by side, each bottom up; what is above them is small.
  const int depth = bvh.shape.levels() - 1;
  const int task_level = std::min(depth, 8);
  tbb::parallel_for(std::uint32_t{0}, 1U << task_level, [&](std::uint32_t task) {
    for (int level = depth; level >= task_level; --level) {
      const std::uint32_t width = 1U << (level - task_level);
      const NodeId first = ((1U << level) - 1) + task * width;
      for (NodeId node = first; node < first + width; ++node) {
        if (level == depth) {
          refit_leaf(scene, vertex_bounds, bvh, node);
        } else {
          refit_inner(bvh, node);
        }
      }
    }
  });
  for (NodeId node = (1U << task_level) - 1; node-- > 0;) refit_inner(bvh, node);
}

template <class Bounds>
double looseness(const Bvh<Bounds>& bvh) {
  if (bvh.nodes.empty()) return 0;
  const auto extent = [](const Bounds& b) {
    return double{b.upper(0) - b.lower(0)} + double{b.upper(1) - b.lower(1)} +
           double{b.upper(2) - b.lower(2)};
  };
  double sum = 0;
  for (NodeId node = 0; node < bvh.shape.first_leaf(); ++node) sum += extent(bvh.nodes[node]);
  const double root = extent(bvh.nodes[0]);
  return root > 0 ? sum / root : 0;
}

template void refit(const Scene&, std::span<const KDop18>, Bvh<Aabb>&);
template void refit(const Scene&, std::span<const KDop18>, Bvh<KDop18>&);
template double looseness(const Bvh<Aabb>&);
template double looseness(const Bvh<KDop18>&);

}  // namespace warmfront

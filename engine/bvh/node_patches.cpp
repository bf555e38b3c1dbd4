// SPDX-License-Identifier: Apache-2.0
#include "engine/bvh/node_patches.h"

#include <algorithm>

namespace warmfront {
namespace {

std::uint32_t patch_of(const Face& vertices, std::span<const std::uint32_t> patches) {
  const std::uint32_t patch = patches[vertices[0]];
  return patch == patches[vertices[1]] && patch == patches[vertices[2]] ? patch : 0;
}

}  // namespace

std::vector<std::uint32_t> node_patches(const Scene& scene, const TreeShape& shape,
                                        std::span<const Primitive> order,
                                        std::span<const std::uint32_t> patches, StopSignal stop) {
  std::vector<std::uint32_t> of_nodes;
  if (patches.empty() || order.empty()) return of_nodes;
  of_nodes.resize(shape.node_count());
  PacedStop paced(stop, 64);
  for (std::uint32_t i = shape.node_count(); i-- > 0;) {
    const NodeId node{i};
    paced.check();
    if (!shape.is_leaf(node)) {
      const std::uint32_t left = of_nodes[number_of(TreeShape::left(node))];
      of_nodes[i] = left == of_nodes[number_of(TreeShape::right(node))] ? left : 0;
      continue;
    }
    const std::uint32_t begin = shape.begin(node), end = shape.end(node);
    const std::uint32_t patch = patch_of(primitive_vertices(scene, order[begin]), patches);
    const bool whole = std::ranges::all_of(order.subspan(begin, end - begin), [&](Primitive primitive) {
      return patch_of(primitive_vertices(scene, primitive), patches) == patch;
    });
    of_nodes[i] = whole ? patch : 0;
  }
  if (std::ranges::all_of(of_nodes, [](std::uint32_t patch) { return patch == 0; })) of_nodes = {};
  return of_nodes;
}

}  // namespace warmfront

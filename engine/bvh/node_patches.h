// SPDX-License-Identifier: Apache-2.0
// Which nodes of a hierarchy lie in one patch (PairFilters::patches), so that a traversal ends where two of
// them do: no pair of features below them counts. Pure functions.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "engine/bvh/tree_shape.h"
#include "engine/scene.h"
#include "engine/scene/primitives.h"
#include "engine/stop.h"

namespace warmfront {

/// By node: the patch that all vertices below it are in; 0 where they are in several, or some in none. Empty
/// where that is every node's. `patches` by vertex of `scene`, or empty; `order` as Bvh::order. O(P). Throws
/// Stopped when told to stop.
std::vector<std::uint32_t> node_patches(const Scene& scene, const TreeShape& shape,
                                        std::span<const Primitive> order,
                                        std::span<const std::uint32_t> patches, StopSignal stop = {});

/// Two lists of node_patches(), or one twice.
class PatchesOfTwo {
 public:
  PatchesOfTwo(std::span<const std::uint32_t> a, std::span<const std::uint32_t> b)
      : a_(a.empty() || b.empty() ? nullptr : a.data()), b_(b.data()) {}

  /// Are both nodes in one patch? Then all primitives below them are.
  bool are_one(NodeId a, NodeId b) const {
    return a_ != nullptr && a_[number_of(a)] != 0 && a_[number_of(a)] == b_[number_of(b)];
  }

 private:
  const std::uint32_t* a_;  // null: no two are
  const std::uint32_t* b_;
};

}  // namespace warmfront

// SPDX-License-Identifier: Apache-2.0
// Checks one part's hierarchy: a part of the self-check (self_check.h). Reads only; any number of threads may
// check different nodes.
#pragma once

#include <cstdint>

#include "engine/bvh/bvh.h"
#include "engine/bvh/topology.h"
#include "engine/state/core.h"
#include "engine/stop.h"

namespace warmfront {

template <class Bounds>
class HierarchyCheck {
 public:
  /// Of a part's hierarchy, whose bounds are those of the last step. All must outlive the check.
  HierarchyCheck(const Bvh<Bounds>& tree, const PartTopology& part, const Core& core, StopSignal stop)
      : tree_(tree), part_(part), core_(core), stop_(stop) {}

  /// Does it contain the part's primitives, each once? O(P log P). Throws Stopped when told to stop, as the
  /// next two do.
  bool holds_each_once() const;
  /// Are the patches of its nodes those of the filters? O(P).
  bool patches_agree() const;
  /// Do its leaves, their blocks and what these know of shared vertices match the order of its primitives?
  /// O(P).
  bool leaves_agree() const;
  /// Do a node's bounds contain what is below it: its children, or its blocks and primitives?
  bool node_holds(NodeId node) const;

  /// Leaves, or nodes, between two looks at the stop signal.
  static constexpr std::size_t kAtOnce = 64;

 private:
  bool blocks_agree(NodeId leaf) const;
  static bool holds_numbers(const LeafGrid<Bounds>& grid, const EightBounds<Bounds>& eight,
                            std::uint32_t slot, const Bounds& inner);

  const Bvh<Bounds>& tree_;
  const PartTopology& part_;
  const Core& core_;
  StopSignal stop_;
};

}  // namespace warmfront

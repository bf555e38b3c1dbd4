// SPDX-License-Identifier: Apache-2.0
// How far a hierarchy's nodes and blocks have travelled. Written by refit.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "engine/bounds/moving.h"
#include "engine/bvh/travel.h"
#include "engine/parallel/unwritten_list.h"
#include "engine/scene/held_bytes.h"

namespace warmfront {

/// Nodes' or blocks' travel at the end of a trial, and at the base that it began from.
struct TrialTravel {
  std::span<const NodeTravel> end;
  std::span<const NodeTravel> base;

  /// What one has wandered in the trial.
  std::uint32_t wandered(std::uint32_t at) const { return end[at].wandered - base[at].wandered; }
};

/// A trial of which budgets were granted at the end is left, for where motions begin from now on.
enum class TrialLeft : std::uint8_t {
  kForBase,     ///< where it began
  kForPartWay,  ///< somewhere on its way
};

/// What becomes of the budget of a pair that may have been granted at the trial's end: it holds for what
/// begins elsewhere, too, less what it takes to come there. Of a pair that was o apart there, with a gap g,
/// and has wandered m in the trial: where the pair is o' apart after wandering by z from the base, it has
/// come nearer by |o' - o| + m + z at most since; the travel of such a place counts z, and that of the end m.
/// So 2 m less is promised. On the way a part f of the trial away from the base, travel counts m, of which it
/// took (1 - f) m <= m to go back. kForBase: spent where it does not last at the base. Returns false where
/// that was done.
inline bool leave_trial(TravelBudget& budget, const TrialTravel& of_a, std::uint32_t a,
                        const TrialTravel& of_b, std::uint32_t b, TrialLeft left, std::uint32_t reserve) {
  constexpr std::uint32_t kFar = travel::kMost / 2;  // further than budgets last; sums of it do not overflow
  if (!budget.granted_at(of_a.end[a], of_b.end[b])) return true;
  const std::uint32_t wandered = of_a.wandered(a) + of_b.wandered(b);
  if (wandered == 0) return true;  // neither has moved
  if (left == TrialLeft::kForPartWay) {
    wandered < kFar ? budget.charge(wandered) : budget.spend(of_a.end[a], of_b.end[b]);
    return true;
  }
  if (wandered < kFar) {
    budget.charge(2 * wandered);
    if (!budget.exhausted(of_a.base[a], of_b.base[b], reserve)) return true;
  }
  budget.spend(of_a.base[a], of_b.base[b]);
  return false;
}

/// All empty where no front keeps budgets.
struct TreeTravel {
  std::vector<NodeTravel> nodes;   ///< by NodeId
  std::vector<NodeTravel> blocks;  ///< by block of a wide leaf, as a leaf's
  /// Both at the base that trials begin from, while there are trials; else of no use.
  std::vector<NodeTravel> base_nodes, base_blocks;
  UnwrittenList<std::uint32_t> first_corners;  ///< by block, as first_corners(): its vertices, each once
  std::uint32_t slack = 0;  ///< what rounding can hide of a node's travel, in its units

  /// At an end of the last motion; kStart: of a trial.
  std::span<const NodeTravel> nodes_at(GapAt end) const { return end == GapAt::kEnd ? nodes : base_nodes; }
  std::span<const NodeTravel> blocks_at(GapAt end) const { return end == GapAt::kEnd ? blocks : base_blocks; }

  /// `off_base`: the last trial added to both.
  TrialTravel nodes_of_trial(bool off_base) const { return {nodes, off_base ? base_nodes : nodes}; }
  TrialTravel blocks_of_trial(bool off_base) const { return {blocks, off_base ? base_blocks : blocks}; }

  std::size_t memory_bytes() const {
    return held_bytes(nodes, blocks, base_nodes, base_blocks, first_corners);
  }
};

}  // namespace warmfront

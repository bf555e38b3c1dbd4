// SPDX-License-Identifier: Apache-2.0
// Blocks of a part that share a vertex. They never come apart as a whole, so no traversal could end above
// them: most of what a front looks at in a deforming surface is that its neighbourhoods still do not meet
// themselves. So each two of them have a place of their own, and a budget that counts their own motion.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "engine/bvh/bvh.h"
#include "engine/front/rest_answer.h"

namespace warmfront {

/// Two blocks of a part, or one with itself, and for how long their primitives need not be tested against
/// each other.
struct NeighbourPair {
  std::uint32_t a;  ///< block numbers, a <= b
  std::uint32_t b;
  TravelBudget budget;
  std::uint64_t excluded;  ///< as Bvh::excluded() says: kept here, where it comes with the rest
};

/// Some of a part's pairs, by the leaves that their blocks are in. Plain values; changed by one thread at a
/// time.
struct NeighbourChunk {
  static constexpr std::size_t kPairs = 512;  ///< about, where they are not all that a subtree has

  struct Leaves {
    std::uint32_t a;  ///< counted from the first leaf
    std::uint32_t b;
    std::uint32_t end;  ///< where their pairs end; they begin where those of the leaves before end
    bool operator==(const Leaves&) const = default;
  };
  std::vector<Leaves> leaves;
  std::vector<NeighbourPair> pairs;
  NodeSet nodes;  ///< all leaves
  /// Already in this step, by Front::test_subtree(); advance() takes the mark back.
  bool tested = false;
  /// Some pair has no budget: there may be something to tell of it even when nothing moves.
  bool may_have_contacts = true;
  /// What was found when nothing moved, which holds in every step until a leaf changes.
  struct AtRest {
    bool known = false;
    RestAnswer answer;
  };
  AtRest at_rest;

  std::size_t list_bytes() const {
    return sizeof(*this) + leaves.capacity() * sizeof(Leaves) + pairs.capacity() * sizeof(NeighbourPair);
  }
  std::size_t memory_bytes() const {
    return list_bytes() + at_rest.answer.contacts.capacity() * sizeof(Contact);
  }
};

/// Puts the places in `pairs` of those whose budget is spent into `due`, which has room for all; returns how
/// many. `travel` is by block, `slack` that of two.
std::size_t due_neighbours(std::span<const NeighbourPair> pairs, std::span<const NodeTravel> travel,
                           std::uint32_t slack, std::uint32_t* due);

/// All pairs of blocks that have a place in `tree.shared`, with budgets that are spent; none where the tree
/// keeps no travel of blocks. First a chunk for each subtree (TreeShape::subtree_of()), of the pairs that are
/// in it, then those that are in two. O(P). Throws Stopped when told to stop.
template <class Bounds>
std::vector<NeighbourChunk> list_neighbours(const Bvh<Bounds>& tree, StopSignal stop = {});

}  // namespace warmfront

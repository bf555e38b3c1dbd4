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
#include "engine/scene/part_id.h"

namespace warmfront {

/// Two blocks of a part, or one with itself, and for how long their primitives need not be tested against
/// each other.
struct NeighbourPair {
  BlockId a;  ///< a <= b
  BlockId b;
  TravelBudget budget;
  std::uint64_t excluded;  ///< as Bvh::excluded() says: kept here, where it comes with the rest
};

/// Some of a part's pairs, by the leaves that their blocks are in. Plain values; changed by one thread at a
/// time.
struct NeighbourChunk {
  static constexpr std::size_t kPairs = 256;  ///< about, where they are not all that a subtree has

  struct Leaves {
    LeafId a;
    LeafId b;
    std::uint32_t end;  ///< where their pairs end; they begin where those of the leaves before end
    bool operator==(const Leaves&) const = default;
  };
  std::vector<Leaves> leaves;
  std::vector<NeighbourPair> pairs;
  NodeSet nodes;  ///< all leaves
  /// Some pair's budget does not last for the width of the last question: there may be something to tell of
  /// it even when nothing moves.
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
/// many. `travel` is by block, `reserve` as travel::reserve() says.
std::size_t due_neighbours(std::span<const NeighbourPair> pairs, std::span<const NodeTravel> travel,
                           std::uint32_t reserve, std::uint32_t* due);

/// All pairs of blocks that have a place in `tree.leaves.shared`, with budgets that are spent, but those of
/// leaves in one patch; none where the tree keeps no travel of blocks. First a chunk for each subtree
/// (TreeShape::subtree_of()), of the pairs that are in it, then those that are in two. O(P). Throws Stopped
/// when told to stop.
template <class Bounds>
std::vector<NeighbourChunk> list_neighbours(const Bvh<Bounds>& tree, StopSignal stop = {});

/// The same where `before` was listed before the hierarchy changed in these blocks alone: budgets of pairs of
/// others are those that they had. It has as many subtrees as then.
template <class Bounds>
std::vector<NeighbourChunk> follow_neighbours(const Bvh<Bounds>& tree, std::vector<NeighbourChunk> before,
                                              std::span<const std::uint8_t> changed_blocks, StopSignal stop);

/// The lists of all parts that have one. Used by one thread at a time, but for what is const; the chunks of
/// one list may be changed by one thread each.
class Neighbours {
 public:
  bool listed(PartId part) const {
    return number_of(part) < of_part_.size() && !of_part_[number_of(part)].chunks.empty();
  }
  /// The list of a part; empty where there is none.
  std::span<NeighbourChunk> of(PartId part) {
    return number_of(part) < of_part_.size() ? std::span(of_part_[number_of(part)].chunks)
                                             : std::span<NeighbourChunk>();
  }
  std::span<const NeighbourChunk> of(PartId part) const {
    return number_of(part) < of_part_.size() ? std::span(of_part_[number_of(part)].chunks)
                                             : std::span<const NeighbourChunk>();
  }

  /// Lists the neighbours of a part with this hierarchy, if that was not tried since forget() and all lists
  /// are no larger than `max_bytes` then. Returns whether the part has neighbours that were not listed
  /// before. Throws Stopped when told to stop.
  template <class Bounds>
  bool list(PartId part, const Bvh<Bounds>& tree, std::size_t max_bytes, StopSignal stop);
  /// The hierarchy of a part whose neighbours are listed has changed in these blocks alone, by block: budgets
  /// of all others stay. Returns false where the lists would be larger than `max_bytes`, or are divided
  /// otherwise: forget() must follow. Throws Stopped when told to stop.
  template <class Bounds>
  bool follow(PartId part, const Bvh<Bounds>& tree, std::span<const std::uint8_t> changed_blocks,
              std::size_t max_bytes, StopSignal stop);
  void forget(PartId part);
  void clear();
  /// Forgets what was found of neighbours that do not move.
  void forget_answers();
  /// See Front::settle() and Front::leave_trial().
  void settle(PartId part, std::span<const NodeTravel> block_travel, std::uint32_t reserve) noexcept;
  void leave_trial(PartId part, const TrialTravel& blocks, TrialLeft left, std::uint32_t reserve) noexcept;

  /// Bytes of the lists, and of these with what is kept of neighbours that do not move: both are the same for
  /// any number of threads.
  std::size_t list_bytes() const { return list_bytes_; }
  std::size_t pair_bytes() const;
  std::size_t memory_bytes() const;

 private:
  struct OfPart {
    std::vector<NeighbourChunk> chunks;
    bool tried = false;  ///< there may have been none, or no room
    std::uint32_t subtrees = 0;  ///< of the hierarchy when it was listed
  };

  std::vector<OfPart> of_part_;
  std::size_t list_bytes_ = 0;
};

}  // namespace warmfront

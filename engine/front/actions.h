// SPDX-License-Identifier: Apache-2.0
// What an update does with each thing that the front holds, decided here alone. Pure functions of what the
// front holds, of the step's motion and of what was asked for.
#pragma once

#include <cstdint>

#include "engine/front/descend.h"
#include "engine/front/neighbours.h"
#include "engine/front/segment.h"

namespace warmfront {

/// What becomes of the answers (contacts found) of stationary leaf pairs.
enum class Answers : std::uint8_t {
  kReuse,   ///< those of the last step hold, and what is found now is stored
  kRenew,   ///< those of the last step are void: leaf pairs are tested, and what is found now is stored
  kForget,  ///< leaf pairs are tested in every step, and nothing is stored
};

/// The answers of a segment whose neighbours were listed just now: until then its leaf pairs handed them
/// over, and what was found of them is in the answers.
inline Answers answers_after_listing(Answers answers) {
  return answers == Answers::kReuse ? Answers::kRenew : answers;
}

/// A segment: the pairs below two parts.
enum class SegmentAction : std::uint8_t {
  kBuild,   ///< traverse from the root
  kReuse,   ///< hand over the stored answers of all pairs; no pair changes
  kUpdate,  ///< go through the chunks
};
inline SegmentAction action_of(const FrontSegment& segment, bool parts_rest, Answers answers) {
  if (segment.chunks.empty()) return SegmentAction::kBuild;
  return parts_rest && answers == Answers::kReuse ? SegmentAction::kReuse : SegmentAction::kUpdate;
}

/// A chunk of a segment that is updated.
enum class ChunkAction : std::uint8_t {
  kReuse,   ///< hand over the stored answers of all pairs; no pair changes
  kUpdate,  ///< go through the pairs
};
/// Where pairs are folded (`prune`), ancestors may have changed where the nodes have not. All pairs below one
/// that has come apart fold together, or those that do are lost: so no chunk is passed over then.
template <class Bounds>
ChunkAction action_of(const FrontChunk& chunk, const TreePair<Bounds>& trees, bool prune, Answers answers) {
  const bool clean =
      !chunk.nodes_a.meets(trees.a.motion.changed) && !chunk.nodes_b.meets(trees.b.motion.changed);
  return clean && !prune && answers == Answers::kReuse ? ChunkAction::kReuse : ChunkAction::kUpdate;
}

/// A pair of a chunk that is updated. `wider` than the question before: what was apart may be within its width.
enum class PairAction : std::uint8_t {
  kReuse,  ///< neither node changed, nor what is near: hand over its stored answers
  kSkip,   ///< its budget lasts: its nodes are still apart
  kTest,   ///< test its bounds, and open it or hand it over where they overlap
};
template <class Bounds>
PairAction action_of(const FrontPair& pair, const TreePair<Bounds>& trees, bool lazy, bool wider,
                     Answers answers) {
  const bool clean = !wider && (trees.state(pair.nodes) & kChanged) == 0;
  if (clean && (answers == Answers::kReuse || !trees.bvtt().is_leaf(pair.nodes))) return PairAction::kReuse;
  const bool lasts =
      lazy && !pair.budget.exhausted(trees.a.travel.nodes[number_of(pair.nodes.a)],
                                     trees.b.travel.nodes[number_of(pair.nodes.b)], trees.reserve());
  return lasts ? PairAction::kSkip : PairAction::kTest;
}

/// A chunk of neighbours that was not tested with the refit of its subtree.
enum class NeighbourAction : std::uint8_t {
  kTest,       ///< some of it moved: test those whose budget is used up
  kSkip,       ///< nothing moved, and all are apart
  kTestAgain,  ///< nothing moved: test those without a budget, store nothing
  kTestStore,  ///< nothing moved: test those without a budget, store the answers
  kReuse,      ///< nothing moved: hand over the stored answers
};
inline NeighbourAction action_of(const NeighbourChunk& chunk, const NodeSet& changed, bool wider,
                                 Answers answers) {
  if (chunk.nodes.meets(changed)) return NeighbourAction::kTest;
  if (!chunk.may_have_contacts && !wider) return NeighbourAction::kSkip;
  if (answers == Answers::kForget) return NeighbourAction::kTestAgain;
  return answers == Answers::kReuse && chunk.at_rest.known ? NeighbourAction::kReuse
                                                           : NeighbourAction::kTestStore;
}

}  // namespace warmfront

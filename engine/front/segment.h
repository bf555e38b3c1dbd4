// SPDX-License-Identifier: Apache-2.0
// A segment of the front: the pairs below one pair of parts. Plain values; a chunk is changed by one thread
// at a time.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "engine/broad_phase/part_pair.h"
#include "engine/contact.h"
#include "engine/front/descend.h"
#include "engine/front/rest_answer.h"
#include "engine/stop.h"

namespace warmfront {

/// A pair of the front, and for how long it need not be looked at.
struct FrontPair {
  NodePair nodes;
  TravelBudget budget;
  bool adjacent = false;         ///< leaves that share a vertex: they overlap, and need no test to tell
  std::uint64_t neighbours = 0;  ///< see LeafGap
};

/// The budget of a pair whose nodes are `gap` apart; none where travel is not kept.
template <class Bounds>
TravelBudget grant_budget(const TreePair<Bounds>& trees, const NodePair& pair, float gap) {
  return trees.a.travel.nodes.empty() || trees.b.travel.nodes.empty()
             ? TravelBudget{}
             : TravelBudget::grant(trees.a.travel.nodes_at(trees.gap_at)[number_of(pair.a)],
                                   trees.b.travel.nodes_at(trees.gap_at)[number_of(pair.b)], gap);
}

/// What is kept of stationary leaf pairs: a RestAnswer each.
struct KeptAnswers {
  struct OfPair {
    std::uint32_t pair;            ///< its place in the chunk
    std::uint32_t triangle_pairs;  ///< whose bounds overlap
    std::uint32_t contacts;        ///< the next so many of `contacts`
    ContactTally tally = {};
  };
  std::vector<OfPair> pairs;  ///< ascending; those of which there is anything to keep
  std::vector<Contact> contacts;

  bool empty() const { return pairs.empty(); }
  void clear() {
    pairs.clear();
    contacts.clear();
  }
  /// What it takes to keep them: the same for any number of threads.
  std::size_t bytes() const { return pairs.size() * sizeof(OfPair) + contacts.size() * sizeof(Contact); }
  std::size_t memory_bytes() const {
    return pairs.capacity() * sizeof(OfPair) + contacts.capacity() * sizeof(Contact);
  }
};

/// A run of pairs in depth-first order, the unit of work.
struct FrontChunk {
  static constexpr std::size_t kPairs = 64;  ///< about; a leaf pair may be thousands of triangle pairs

  std::vector<FrontPair> pairs;
  KeptAnswers kept;
  NodeSet nodes_a;  ///< of all pairs
  NodeSet nodes_b;

  /// After the pairs changed.
  void find_nodes() {
    nodes_a = nodes_b = {};
    for (const FrontPair& pair : pairs) {
      nodes_a.add(pair.nodes.a);
      nodes_b.add(pair.nodes.b);
    }
  }
  std::size_t memory_bytes() const {
    return sizeof(*this) + pairs.capacity() * sizeof(FrontPair) + kept.memory_bytes();
  }
};

struct FrontSegment {
  PartPair parts;
  std::vector<FrontChunk> chunks;
  std::size_t size = 0;  ///< pairs
  /// By chunk, of its last update, in tests of two nodes, about; 0 where it is not known. Empty of few
  /// chunks.
  std::vector<std::uint32_t> costs;

  bool with_itself() const { return parts.a == parts.b; }
  /// As before the first build.
  void clear() {
    chunks.clear();
    costs.clear();
    size = 0;
  }
};

/// What a segment's chunks come to.
struct ChunkSums {
  std::size_t pairs = 0;
  std::size_t bytes = 0;   ///< memory_bytes()
  bool too_large = false;  ///< is one much larger than the others?
};
/// Parallel. Throws Stopped when told to stop.
ChunkSums sums_of(std::span<const FrontChunk> chunks, StopSignal stop);

/// Divides the segment's pairs into chunks again where one is much larger than the others, or many are much
/// smaller: they are the unit of work. Chunks that are left as they are only change hands. Takes its size,
/// and returns what its chunks come to then. Parallel. Throws Stopped when told to stop; the segment is good
/// for clear() only then.
ChunkSums rebalance(FrontSegment& segment, StopSignal stop);

}  // namespace warmfront

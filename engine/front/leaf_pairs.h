// SPDX-License-Identifier: Apache-2.0
// Where the front hands over: overlapping leaf pairs go to a sink, one sink a thread.
#pragma once

#include <algorithm>
#include <cstdint>
#include <limits>
#include <span>

#include "engine/broad_phase/part_pair.h"
#include "engine/bvh/bvtt.h"
#include "engine/front/neighbours.h"
#include "engine/front/rest_answer.h"
#include "engine/parallel/stage_clock.h"

namespace warmfront {

/// What is learnt of a leaf pair.
struct LeafGap {
  /// How far apart at t = 1 the nearest two of their primitives are that share no vertex, as separation()
  /// measures it, or less; not positive when some of them overlap then.
  float gap;
  /// Some of their primitives share a vertex: so the leaves overlap in every step.
  bool adjacent;
  /// Bit 8 i + j: block i of the one and block j of the other are neighbours that were not tested. The same
  /// in every step.
  std::uint64_t neighbours = 0;
  /// Blocks, numbered so, of which nothing is learnt yet: testing them would have been too much at once.
  std::uint64_t left = 0;

  static LeafGap of_nothing() { return {std::numeric_limits<float>::max(), false, 0, ~std::uint64_t{0}}; }
  /// Of others of the leaves' blocks: all that were left.
  void add(const LeafGap& more) {
    gap = std::min(gap, more.gap);
    adjacent |= more.adjacent;
    neighbours |= more.neighbours;
    left = 0;
  }
};

/// Which of two leaves' blocks are to be tested against each other.
struct LeafBlocks {
  bool skip_neighbours = false;  ///< not those that list_neighbours() lists
  std::uint64_t neighbours = 0;  ///< which these are, as LeafGap says; 0 where that is not known, or none is
  std::uint64_t among = ~std::uint64_t{0};  ///< only of these, numbered so
  /// After so many triangle pairs no more blocks are begun, and LeafGap::left says which are left.
  std::uint64_t at_once = ~std::uint64_t{0};
};

/// Takes leaf pairs as they are found. Used by one thread at a time.
class LeafPairSink {
 public:
  virtual ~LeafPairSink() = default;

  /// Leaves of two parts whose bounds overlap; of one part, a < b, or a leaf against itself, a == b. What
  /// met on the way and came apart again need not be met in the next step.
  virtual LeafGap leaf_pair(const PartPair& parts, const NodePair& leaves, const LeafBlocks& which) = 0;

  /// The same for stationary leaves; adds what it finds to `answer` as well.
  virtual LeafGap leaf_pair_at_rest(const PartPair& parts, const NodePair& leaves, const LeafBlocks& which,
                                    RestAnswer& answer) = 0;
  /// Neighbours of a part, of which those whose budget is spent are tested, and get another one.
  virtual void neighbours(PartId part, NeighbourChunk& chunk) = 0;
  /// The same where nothing moves; what is found is in `chunk.at_rest` too.
  virtual void neighbours_at_rest(PartId part, NeighbourChunk& chunk) = 0;
  /// What was found in an earlier step, of leaves that have not moved since: a RestAnswer.
  virtual void keep(std::uint64_t triangle_pairs, const ContactTally& tally,
                    std::span<const Contact> contacts) = 0;
  /// So many triangle pairs have been found here in this step: what the work was, about.
  virtual std::uint64_t triangle_pairs() const = 0;
};

/// Gives each thread its own sink and clock. Thread-safe.
class LeafPairSinks {
 public:
  virtual ~LeafPairSinks() = default;
  virtual LeafPairSink& local() = 0;
  /// The thread's clock.
  virtual StageClock& clock() = 0;
};

}  // namespace warmfront

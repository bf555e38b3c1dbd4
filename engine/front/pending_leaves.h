// SPDX-License-Identifier: Apache-2.0
// Leaf pairs that a task has found and not tested yet. No box tells what a leaf pair costs: in crumpled cloth
// it is hundreds of times what it is elsewhere. So a task tests what it has found itself, until that turns
// out to be much, be it in the middle of a pair, and shares the rest out from then on.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <utility>

#include "engine/front/leaf_pairs.h"
#include "engine/parallel/fork_within.h"

namespace warmfront {

/// Used by one thread at a time, for one chunk of the front.
class PendingLeaves {
 public:
  struct Pair {
    NodePair leaves;
    std::uint32_t place;       ///< among the chunk's pairs
    std::uint64_t neighbours;  ///< as LeafBlocks has them
  };

  /// The next pairs are those of another chunk. `sink` is this thread's.
  void begin(const LeafPairSink& sink) {
    count_ = 0;
    done_before_ = sink.triangle_pairs();
  }

  /// There must be room: test() makes it.
  void add(const Pair& pair) { pairs_[count_++] = pair; }
  bool full() const { return count_ == kMost; }

  /// Tests all, in any order and by any threads, and calls `take` with each and its LeafGap, in the order in
  /// which they were added. `sink` is this thread's; `wide`: leaves have several blocks.
  template <class Take>
  void test(const PartPair& parts, bool skip_neighbours, bool wide, LeafPairSink& sink, LeafPairSinks& sinks,
            Take&& take) {
    std::uint32_t tested = 0;
    LeafGap begun = LeafGap::of_nothing();
    for (; tested < count_; ++tested) {
      const std::uint64_t done = sink.triangle_pairs() - done_before_;
      if (done >= kOneTask) break;
      const Pair& pair = pairs_[tested];
      begun = sink.leaf_pair(parts, pair.leaves, {skip_neighbours, pair.neighbours, kAll, kOneTask - done});
      if (begun.left != 0) break;
      take(pair, std::exchange(begun, LeafGap::of_nothing()));
    }
    if (tested < count_) share_out(tested, begun, parts, skip_neighbours, wide, sinks, take);
    count_ = 0;
  }

 private:
  // Tests those from here on, of the first what is left of it. Those of wide leaves are several tasks each.
  template <class Take>
  void share_out(std::uint32_t first, const LeafGap& begun, const PartPair& parts, bool skip_neighbours,
                 bool wide, LeafPairSinks& sinks, Take&& take) {
    const std::uint32_t tasks = wide ? kTasks : 1;
    fork_within(first * tasks, count_ * tasks, [&](std::uint32_t i) {
      const StageClock::In front(sinks.clock(), Stage::kFront);
      const Pair& pair = pairs_[i / tasks];
      const std::uint64_t left = i / tasks == first ? begun.left : kAll;
      const std::uint64_t among = wide ? left & kOfTask << (64 / kTasks * (i % tasks)) : left;
      learnt_[i] =
          among == 0 ? LeafGap::of_nothing()
                     : sinks.local().leaf_pair(parts, pair.leaves, {skip_neighbours, pair.neighbours, among});
    });
    for (std::uint32_t pair = first; pair < count_; ++pair) {
      LeafGap learnt = pair == first ? begun : LeafGap::of_nothing();
      for (std::uint32_t task = 0; task < tasks; ++task) learnt.add(learnt_[pair * tasks + task]);
      take(pairs_[pair], learnt);
    }
  }

  static constexpr std::uint32_t kMost = 64;
  static constexpr std::uint32_t kTasks = 8;  // of a pair of wide leaves that is shared out
  static constexpr std::uint64_t kAll = ~std::uint64_t{0};
  static constexpr std::uint64_t kOfTask = (std::uint64_t{1} << 64 / kTasks) - 1;  // a block of the first
  /// Triangle pairs that are worth a task of their own: some 0.2 ms.
  static constexpr std::uint64_t kOneTask = 512;

  std::array<Pair, kMost> pairs_;
  std::array<LeafGap, kMost * kTasks> learnt_;
  std::uint32_t count_ = 0;
  std::uint64_t done_before_ = 0;  // by this thread's sink
};

}  // namespace warmfront

// SPDX-License-Identifier: Apache-2.0
// The stage that lists each closest pair once: see ColliderOptions::reduced. Used by one thread at a time,
// inside Workers::run().
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "engine/state/core.h"
#include "engine/stop.h"

namespace warmfront {

class ReducedRows {
 public:
  /// Of core.found()'s contacts, which are sorted, leaves the first with each closest pair, and writes its
  /// closest_pairs; empties these where the question is not reduced. Parallel; O(rows + vertices), but for
  /// the rows that meet in one vertex, which are sorted. Throws Stopped when told to stop.
  void run(Core& core, StopSignal stop);

  std::size_t memory_bytes() const;

 private:
  /// A closest pair that other rows may have, too: two vertices in the list 2 v of the lesser one, an edge
  /// and a vertex v in the list 2 v + 1.
  struct Shared {
    std::uint32_t list = kNone;
    std::uint32_t other = 0;  ///< the greater vertex, or the edge
  };
  /// A row in one of the lists.
  struct Listed {
    std::uint32_t other;
    std::uint32_t row;
  };
  static constexpr std::uint32_t kNone = 0xffffffff;  // faces number their vertices below 2^31

  static Shared shared_by(const Scene& scene, const Contact& contact, std::uint8_t stencil);
  void find_closest(Core& core, StopSignal stop);
  void list_shared(std::uint32_t vertices, StopSignal stop);
  void count(std::vector<ClosestPair>& pairs, StopSignal stop);
  static void keep_first(FoundPairs& found, StopSignal stop);

  std::vector<Shared> shared_;        // by row
  std::vector<std::uint32_t> begin_;  // of each list in `listed_`
  std::vector<Listed> listed_;
};

}  // namespace warmfront

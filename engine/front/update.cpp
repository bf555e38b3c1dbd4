// SPDX-License-Identifier: Apache-2.0
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>

#include "engine/front/chunk_update.h"
#include "engine/front/front.h"

namespace warmfront {

template <class Bounds>
void Front<Bounds>::update(const Bvh<Bounds>& bvh, LeafPairSinks& sinks, bool prune, std::size_t max_bytes) {
  constexpr std::size_t kChunk = ChunkUpdate<Bounds>::kPairs;
  const std::size_t chunks = (pairs_.size() + kChunk - 1) / kChunk;
  outputs_.reset(chunks, max_pairs(max_bytes));
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, chunks, 1), [&](const auto& range) {
    for (std::size_t c = range.begin(); c < range.end(); ++c) {
      ChunkOutputs::Chunk chunk(outputs_, c);
      const std::size_t begin = c * kChunk;
      ChunkUpdate<Bounds>(bvh, sinks.local(), chunk)
          .run(pairs().subspan(begin, std::min(kChunk, pairs_.size() - begin)), prune);
    }
  });
  const ThreadOutput totals = outputs_.totals();
  counts_ = {totals.bv_tests, totals.sprouted, totals.pruned};
  gather();
}

template void Front<Aabb>::update(const Bvh<Aabb>&, LeafPairSinks&, bool, std::size_t);
template void Front<KDop18>::update(const Bvh<KDop18>&, LeafPairSinks&, bool, std::size_t);

}  // namespace warmfront

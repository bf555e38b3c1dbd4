// SPDX-License-Identifier: Apache-2.0
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include "engine/front/chunk_update.h"
#include "engine/front/front.h"

namespace warmfront {

template <class Bounds>
void Front<Bounds>::update(const Bvh<Bounds>& bvh, LeafPairSinks& sinks, FrontUpdate how,
                           std::size_t max_bytes) {
  begin(max_bytes);
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, chunks_.size(), 1), [&](const auto& range) {
    Scratch& scratch = scratch_.local();
    LeafPairSink& sink = sinks.local();
    for (std::size_t c = range.begin(); c < range.end(); ++c) {
      ChunkUpdate<Bounds> update(bvh, sink, how, scratch.pairs, scratch.counts);
      if (update.run(chunks_[c])) {
        store(scratch.pairs, chunks_[c]);
      } else {
        recorded_.fetch_add(chunks_[c].size(), std::memory_order_relaxed);
      }
    }
  });
  finish();
}

template void Front<Aabb>::update(const Bvh<Aabb>&, LeafPairSinks&, FrontUpdate, std::size_t);
template void Front<KDop18>::update(const Bvh<KDop18>&, LeafPairSinks&, FrontUpdate, std::size_t);

}  // namespace warmfront

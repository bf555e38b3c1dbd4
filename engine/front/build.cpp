// SPDX-License-Identifier: Apache-2.0
#include <tbb/parallel_for.h>

#include "engine/front/build_tasks.h"
#include "engine/front/descend.h"
#include "engine/front/front.h"

namespace warmfront {

template <class Bounds>
void Front<Bounds>::build(const Bvh<Bounds>& bvh, LeafPairSinks& sinks, bool record, std::size_t max_bytes) {
  pairs_.clear();
  if (bvh.nodes.empty()) {
    counts_ = {};
    overflowed_ = false;
    return;
  }
  const BuildTasks decomposition = decompose(bvh);
  const auto& tasks = decomposition.tasks;
  // Without recording the cap is zero pairs and nothing is kept from the first chunk's end on; nothing is
  // copied either.
  outputs_.reset(tasks.size(), record ? max_pairs(max_bytes) : 0);
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, tasks.size(), 1), [&](const auto& range) {
    for (std::size_t i = range.begin(); i < range.end(); ++i) {
      ChunkOutputs::Chunk chunk(outputs_, i);
      LeafPairSink& sink = sinks.local();
      const auto [pair, open] = tasks[i];
      const auto terminal = [&](const NodePair& end) {
        if (record) chunk.push(end);
      };
      if (!open || bvh.shape.is_leaf(pair.a)) {
        terminal(pair);
        if (open) sink.leaf_pair(pair.a, pair.b);
      } else {
        descend(bvh, pair, chunk.bv_tests(), sink, terminal);
      }
    }
  });
  const ThreadOutput totals = outputs_.totals();
  counts_ = {totals.bv_tests + decomposition.bv_tests, 0, 0};
  overflowed_ = false;
  if (record) gather();
}

template <class Bounds>
void Front<Bounds>::gather() {
  overflowed_ = outputs_.overflowed();
  if (overflowed_) {
    pairs_ = {};
    outputs_.release();
    return;
  }
  outputs_.concatenate(pairs_);
}

template <class Bounds>
std::size_t Front<Bounds>::memory_bytes() const {
  return pairs_.capacity() * sizeof(NodePair) + outputs_.memory_bytes();
}

template void Front<Aabb>::build(const Bvh<Aabb>&, LeafPairSinks&, bool, std::size_t);
template void Front<KDop18>::build(const Bvh<KDop18>&, LeafPairSinks&, bool, std::size_t);
template void Front<Aabb>::gather();
template void Front<KDop18>::gather();
template std::size_t Front<Aabb>::memory_bytes() const;
template std::size_t Front<KDop18>::memory_bytes() const;

}  // namespace warmfront

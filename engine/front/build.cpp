// SPDX-License-Identifier: Apache-2.0
#include <tbb/parallel_for.h>

#include "engine/front/build_tasks.h"
#include "engine/front/descend.h"
#include "engine/front/front.h"

namespace warmfront {

template <class Bounds>
void Front<Bounds>::build(const Bvh<Bounds>& bvh, LeafPairSinks& sinks, bool record, std::size_t max_bytes) {
  chunks_.clear();
  begin(max_bytes);
  if (bvh.nodes.empty()) return finish();
  const BuildTasks decomposition = decompose(bvh);
  const auto& tasks = decomposition.tasks;
  if (record) chunks_.resize(tasks.size());
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, tasks.size(), 1), [&](const auto& range) {
    Scratch& scratch = scratch_.local();
    LeafPairSink& sink = sinks.local();
    for (std::size_t i = range.begin(); i < range.end(); ++i) {
      scratch.pairs.clear();
      const auto terminal = [&](const NodePair& pair, float gap) {
        // Past the limit there is no point in keeping more.
        if (record && scratch.pairs.size() <= max_pairs_)
          scratch.pairs.push_back({pair, grant_budget(bvh, pair, gap)});
      };
      descend_from(bvh, tasks[i].pair, tasks[i].gap, scratch.counts.bv_tests, sink, terminal);
      if (record) store(scratch.pairs, chunks_[i]);
    }
  });
  finish();
  counts_.bv_tests += decomposition.bv_tests;
}

template void Front<Aabb>::build(const Bvh<Aabb>&, LeafPairSinks&, bool, std::size_t);
template void Front<KDop18>::build(const Bvh<KDop18>&, LeafPairSinks&, bool, std::size_t);

}  // namespace warmfront

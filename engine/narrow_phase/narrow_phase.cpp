// SPDX-License-Identifier: Apache-2.0
#include "engine/narrow_phase/narrow_phase.h"

#include <tbb/enumerable_thread_specific.h>

#include <algorithm>
#include <utility>

#include "engine/narrow_phase/gather_sorted.h"
#include "engine/narrow_phase/leaf_pair_tester.h"
#include "engine/narrow_phase/pair_tester.h"
#include "engine/narrow_phase/world_of.h"
#include "engine/parallel/fork_within.h"
#include "engine/parallel/stoppable_loops.h"
#include "engine/scene/held_bytes.h"

namespace warmfront {
namespace {

/// What a thread's tester has still to test.
struct Pending {
  PairTester* of;
  std::span<const FeaturePair> pairs;
};

}  // namespace

void NarrowPhaseOutput::add(const NarrowPhaseOutput& more) {
  found.add(more.found);
  possible += more.possible;
  overlaps += more.overlaps;
  earliest = std::min(earliest, more.earliest);
  warmfront::add(counts, more.counts);
}

template <class Bounds>
struct NarrowPhase<Bounds>::Impl final : LeafPairTesters<Bounds> {
  tbb::enumerable_thread_specific<LeafPairTester<Bounds>> sinks;
  NarrowPhaseShared shared;
  std::span<const Bvh<Bounds>> trees;
  const NarrowPhaseInput* input = nullptr;
  std::uint64_t step = 0;
  std::vector<const MetPairs*> met;  // of test_met(): by thread, and where its pairs begin among all
  std::vector<std::size_t> met_begin;
  std::vector<Pending> pending;  // of flush(): by thread, and in pieces
  std::vector<std::span<const FeaturePair>> pieces;
  std::vector<std::size_t> orphans_begin;       // of test_orphans(): where each part's blocks begin
  std::vector<std::span<const Contact>> found;  // of finish(): all threads', and room for gather_sorted()
  std::vector<std::size_t> buckets;

  LeafPairTester<Bounds>& local_tester() override {
    LeafPairTester<Bounds>& sink = sinks.local();
    sink.begin(trees, *input, shared, *this, step);
    return sink;
  }
};

template <class Bounds>
NarrowPhase<Bounds>::NarrowPhase() : impl_(std::make_unique<Impl>()) {}
template <class Bounds>
NarrowPhase<Bounds>::~NarrowPhase() = default;

template <class Bounds>
void NarrowPhase<Bounds>::begin(std::span<const Bvh<Bounds>> trees, const NarrowPhaseInput& input) {
  impl_->trees = trees;
  impl_->input = &input;
  impl_->shared.earliest.begin(input.worlds.places());
  for (std::uint32_t world = 0; world < input.until.size(); ++world)
    impl_->shared.earliest.lower(world, input.until[world]);
  impl_->shared.contacts.store(0, std::memory_order_relaxed);
  ++impl_->step;
  for (LeafPairTester<Bounds>& sink : impl_->sinks)
    sink.begin(trees, input, impl_->shared, *impl_, impl_->step);
}

template <class Bounds>
LeafPairSink& NarrowPhase<Bounds>::local() {
  return impl_->local_tester();
}

template <class Bounds>
bool NarrowPhase<Bounds>::knows_met() const {
  std::size_t met = 0;
  for (const LeafPairTester<Bounds>& sink : impl_->sinks) met += sink.tester.met().count;
  return met <= NarrowPhaseInput::kMostMet;
}

template <class Bounds>
bool NarrowPhase<Bounds>::met_kept() const {
  for (const LeafPairTester<Bounds>& sink : impl_->sinks) {
    if (sink.tester.met().rested) return true;
  }
  return false;
}

template <class Bounds>
void NarrowPhase<Bounds>::test_met() {
  constexpr std::size_t kAtOnce = 64;
  std::vector<const MetPairs*>& met = impl_->met;
  std::vector<std::size_t>& begin = impl_->met_begin;
  met.clear();
  begin.assign(1, 0);
  for (const LeafPairTester<Bounds>& sink : impl_->sinks) {
    met.push_back(&sink.tester.met());
    begin.push_back(begin.back() + met.back()->pairs.size());
  }
  LeafPairTester<Bounds>& here = impl_->local_tester();
  for (const MetPairs* of_thread : met) {
    const RestAnswer& kept = of_thread->kept;
    here.keep(kept.triangle_pairs, kept.tally, kept.contacts);
  }
  for_pieces(0, begin.back(), kAtOnce, impl_->input->stop, [&](std::size_t first, std::size_t end) {
    PairTester& tester = impl_->local_tester().tester;
    const StageClock::In front(tester.clock(), Stage::kFront);
    auto of = static_cast<std::size_t>(std::ranges::upper_bound(begin, first) - begin.begin()) - 1;
    for (std::size_t i = first; i < end; ++i) {
      while (i >= begin[of + 1]) ++of;
      const auto [p, q] = met[of]->pairs[i - begin[of]];
      tester.met_pair(p, q);
    }
  });
  flush();
}

// Of few threads each tests its own. Of many one may have most, while the others wait.
template <class Bounds>
void NarrowPhase<Bounds>::flush() {
  std::vector<Pending>& pending = impl_->pending;
  pending.clear();
  for (LeafPairTester<Bounds>& sink : impl_->sinks) pending.push_back({&sink.tester, {}});
  const bool shared = among_many_threads();
  fork_each(std::size_t{0}, pending.size(), [&](std::size_t i) {
    if (shared)
      pending[i].pairs = pending[i].of->pending();
    else
      pending[i].of->flush();
  });
  if (!shared) return;
  constexpr std::size_t kAtOnce = 64;
  std::vector<std::span<const FeaturePair>>& pieces = impl_->pieces;
  pieces.clear();
  for (const Pending& of_thread : pending) {
    for (auto left = of_thread.pairs; !left.empty(); left = left.subspan(pieces.back().size()))
      pieces.push_back(left.first(std::min(kAtOnce, left.size())));
  }
  fork_each(std::size_t{0}, pieces.size(),
            [&](std::size_t i) { impl_->local_tester().tester.test_features(pieces[i]); });
  for (const Pending& of_thread : pending) of_thread.of->drop_pending();
}

template <class Bounds>
PairTester& NarrowPhase<Bounds>::tester() {
  return impl_->local_tester().tester;
}

template <class Bounds>
StageClock& NarrowPhase<Bounds>::clock() {
  return impl_->local_tester().tester.clock();
}

template <class Bounds>
StageSeconds NarrowPhase<Bounds>::take_times() {
  StageSeconds sum{};
  for (LeafPairTester<Bounds>& sink : impl_->sinks) {
    const StageSeconds of_thread = sink.tester.clock().take();
    for (std::size_t stage = 0; stage < sum.size(); ++stage) sum[stage] += of_thread[stage];
  }
  return sum;
}

template <class Bounds>
void NarrowPhase<Bounds>::test_orphans(std::span<OrphanBlocks* const> parts, bool retest) {
  std::vector<std::size_t>& begin = impl_->orphans_begin;
  begin.assign(1, 0);
  for (const OrphanBlocks* part : parts) begin.push_back(begin.back() + part->count());
  fork_range(std::size_t{0}, begin.back(), 1, [&](const auto& range) {
    PairTester& tester = impl_->local_tester().tester;
    auto part = static_cast<std::size_t>(std::ranges::upper_bound(begin, range.begin()) - begin.begin()) - 1;
    for (std::size_t i = range.begin(); i < range.end(); ++i) {
      impl_->input->stop.check();
      while (i >= begin[part + 1]) ++part;
      parts[part]->test(i - begin[part], *parts[part]->range, impl_->input->states, retest, tester);
    }
  });
  flush();
}

template <class Bounds>
void NarrowPhase<Bounds>::test_edge_face_orphans(std::span<const EdgeFaceIds> orphans) {
  constexpr std::size_t kAtOnce = 512;
  for_pieces(0, orphans.size(), kAtOnce, impl_->input->stop, [&](std::size_t first, std::size_t end) {
    PairTester& tester = impl_->local_tester().tester;
    for (std::size_t i = first; i < end; ++i) tester.orphan(orphans[i]);
  });
}

/// So many contacts are put in order by counting.
constexpr std::size_t kMany = 4096;

template <class Bounds>
NarrowPhaseOutput NarrowPhase<Bounds>::finish(UnwrittenList<Contact>& contacts) {
  NarrowPhaseOutput sum;
  const NarrowPhaseInput& input = *impl_->input;
  std::vector<std::span<const Contact>>& lists = impl_->found;
  lists.clear();
  std::size_t found = 0;
  for (LeafPairTester<Bounds>& sink : impl_->sinks) {
    sum.add(sink.tester.output());
    sink.tester.contacts().for_blocks([&](std::span<const Contact> block) { lists.push_back(block); });
    found += sink.tester.contacts().size();
  }
  const bool earliest = input.options.report == Report::kEarliest;
  if (found >= kMany && !earliest) {
    const FirstFeatures of{!input.scene.isolated_vertices().empty(), input.half_spaces};
    gather_sorted(lists, input.scene.vertex_count(), of, input.scene.edge_count(), contacts, impl_->buckets,
                  input.stop);
    return sum;
  }
  contacts.clear();
  reserve(contacts, found, input.stop);
  for (const std::span<const Contact> list : lists) append(contacts, list, input.stop);
  if (earliest) {
    PacedStop paced(input.stop);
    std::erase_if(contacts, [&](const Contact& c) {
      paced.check();
      return c.toi > earliest_in(world_of(c, input.scene, input.numbering, input.worlds));
    });
    sum.found = {};
    for (const Contact& contact : contacts) sum.found.count(contact.kind);
    sum.over_limit = contacts.size() > input.options.max_contacts;
    sum.possible = static_cast<std::uint64_t>(std::ranges::count_if(contacts, [&](const Contact& c) {
      paced.check();
      return c.status == ContactStatus::kPossible || c.status == ContactStatus::kBudget;
    }));
  }
  sort_in_parallel(contacts, input.stop, in_order);
  return sum;
}

template <class Bounds>
double NarrowPhase<Bounds>::earliest_in(std::uint32_t world) const {
  return impl_->shared.earliest.of(world);
}

template <class Bounds>
void NarrowPhase<Bounds>::release() noexcept {
  for (LeafPairTester<Bounds>& sink : impl_->sinks) sink.tester.release();
  std::vector<std::size_t>().swap(impl_->buckets);
}

template <class Bounds>
std::size_t NarrowPhase<Bounds>::memory_bytes() const {
  std::size_t bytes = sizeof(Impl) + impl_->shared.earliest.memory_bytes() +
                      held_bytes(impl_->met, impl_->met_begin, impl_->pending, impl_->pieces,
                                 impl_->orphans_begin, impl_->found, impl_->buckets);
  for (const LeafPairTester<Bounds>& sink : impl_->sinks) bytes += sink.memory_bytes();
  return bytes;
}

template class NarrowPhase<Aabb>;
template class NarrowPhase<KDop18>;

}  // namespace warmfront

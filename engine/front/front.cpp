// SPDX-License-Identifier: Apache-2.0
// The front from step to step, and its storage: segments of chunks of about equal size, in order. Which tasks
// a step has is in front_plan.cpp, what budgets are worth elsewhere in front_budgets.cpp.
#include "engine/front/front.h"

#include <algorithm>
#include <iterator>
#include <utility>

#include "engine/front/actions.h"
#include "engine/front/front_impl.h"
#include "engine/parallel/fork_join.h"
#include "engine/scene/held_bytes.h"

namespace warmfront {
namespace {

/// Answers for which there was no room are not kept for so many steps; then the front is built again.
constexpr std::size_t kTryAgain = 256;

// What was found at rest no longer holds.
void test_moved(PartId part, NeighbourChunk& chunk, LeafPairSink& sink) {
  chunk.at_rest = {};
  sink.neighbours(part, chunk);
}

}  // namespace

template <class Bounds>
Front<Bounds>::Front() : impl_(std::make_unique<Impl>()) {}
template <class Bounds>
Front<Bounds>::~Front() = default;

template <class Bounds>
void Front<Bounds>::run(const Work& work, std::span<const Bvh<Bounds>> trees, LeafPairSinks& sinks,
                        const FrontUpdate& how) {
  how.stop.check();
  FrontSegment& segment = segments_[work.segment];
  const PartPair& parts = segment.parts;
  const TreePair<Bounds> pair(trees[number_of(parts.a)], trees[number_of(parts.b)], how.gap_at,
                              how.widths.of(parts));
  switch (work.kind) {
    case Work::kReuse:
      for (const FrontChunk& chunk : segment.chunks) reuse(chunk, sinks.local(), how.stop);
      break;
    case Work::kNeighbours:
      run_neighbours(pair.a, parts.a, neighbours_.of(parts.a)[work.chunk], sinks.local(), how.wider,
                     work.answers);
      break;
    case Work::kBuild:
    case Work::kUpdate:
      update(work, pair, sinks, how);
  }
}

// Builds or updates a chunk.
template <class Bounds>
void Front<Bounds>::update(const Work& work, const TreePair<Bounds>& trees, LeafPairSinks& sinks,
                           const FrontUpdate& how) {
  FrontSegment& segment = segments_[work.segment];
  FrontChunk& chunk = segment.chunks[work.chunk];
  ChunkScratch& scratch = impl_->scratch.local();
  if (work.kind == Work::kUpdate && action_of(chunk, trees, how.prune, work.answers) == ChunkAction::kReuse) {
    reuse(chunk, sinks.local(), how.stop);
    if (!segment.costs.empty()) segment.costs[work.chunk] = 0;
    scratch.counts.rested += chunk.pairs.size();
    room_.take_pairs(chunk.pairs.size());
    return;
  }
  const bool skip_neighbours = segment.with_itself() && neighbours_.listed(segment.parts.a);
  ChunkUpdate<Bounds> update(trees, segment.parts, skip_neighbours, sinks, how, work.answers, room_, scratch);
  if (work.kind == Work::kBuild) {
    update.build(work.task.pair, work.task.gap);
    return store(chunk);
  }
  const bool changed = update.run(chunk);
  if (!segment.costs.empty()) segment.costs[work.chunk] = static_cast<std::uint32_t>(update.cost());
  if (changed) return store(chunk);
  if (!scratch.kept.empty() || !chunk.kept.empty()) chunk.kept = scratch.kept;
  room_.take_pairs(chunk.pairs.size());
}

// Hands over the stored answers of all pairs.
template <class Bounds>
void Front<Bounds>::reuse(const FrontChunk& chunk, LeafPairSink& sink, StopSignal stop) {
  auto contacts = std::span(chunk.kept.contacts);
  for (const KeptAnswers::OfPair& kept : chunk.kept.pairs) {
    stop.check();
    sink.keep(kept.triangle_pairs, kept.tally, contacts.first(kept.contacts));
    contacts = contacts.subspan(kept.contacts);
  }
  room_.take_answers(chunk.kept.bytes());
}

template <class Bounds>
void Front<Bounds>::begin_step() {
  if (!keeps_answers_ && ++steps_without_them_ >= kTryAgain) clear();
}

template <class Bounds>
void Front<Bounds>::test_subtree(PartId part, std::uint32_t subtree, LeafPairSink& sink) {
  const std::span<NeighbourChunk> neighbours = neighbours_.of(part);
  if (!neighbours.empty()) test_moved(part, neighbours[subtree], sink);
}

template <class Bounds>
void Front<Bounds>::run_neighbours(const Bvh<Bounds>& tree, PartId part, NeighbourChunk& chunk,
                                   LeafPairSink& sink, bool wider, Answers answers) {
  if (answers != Answers::kReuse) chunk.at_rest = {};
  const RestAnswer& stored = chunk.at_rest.answer;
  switch (action_of(chunk, tree.motion.changed, wider, answers)) {
    case NeighbourAction::kTest:
      return test_moved(part, chunk, sink);
    case NeighbourAction::kSkip:
      return;
    case NeighbourAction::kTestAgain:
      return sink.neighbours(part, chunk);
    case NeighbourAction::kTestStore:
      sink.neighbours_at_rest(part, chunk);
      break;
    case NeighbourAction::kReuse:
      sink.keep(stored.triangle_pairs, stored.tally, stored.contacts);
      break;
  }
  if (!room_.take_answers(stored.bytes())) chunk.at_rest = {};
}

template <class Bounds>
void Front<Bounds>::store(FrontChunk& chunk) {
  ChunkScratch& scratch = impl_->scratch.local();
  if (room_.take_pairs(scratch.pairs.size() - scratch.counted)) {
    chunk.pairs.assign(scratch.pairs.begin(), scratch.pairs.end());
    chunk.kept = scratch.kept;
    chunk.find_nodes();
  }
  scratch.trim();
}

template <class Bounds>
void Front<Bounds>::advance(std::span<const Bvh<Bounds>> trees, std::span<const NearPair> near,
                            LeafPairSinks& sinks, const FrontUpdate& wanted) {
  FrontUpdate how = wanted;
  if (!keeps_answers_) how.answers = Answers::kForget;
  for (ChunkScratch& scratch : impl_->scratch) scratch.counts = {};
  counts_ = {};
  updated_ = 0;
  match(near, how.stop);
  room_.begin();
  plan(trees, near, how);
  const std::vector<Work>& first = impl_->first;
  const std::vector<Work>& works = impl_->works;
  room_.allow(how.record ? how.max_bytes - neighbours_.list_bytes() : 0);
  fork_range(std::size_t{0}, first.size() + works.size(), 1, [&](const auto& range) {
    const StageClock::In front(sinks.clock(), Stage::kFront);
    for (std::size_t i = range.begin(); i < range.end(); ++i)
      run(i < first.size() ? first[i] : works[i - first.size()], trees, sinks, how);
  });
  for (const ChunkScratch& scratch : impl_->scratch) counts_.add(scratch.counts);
  size_ = room_.pairs();
  overflowed_ = how.record && room_.pairs_lost();
  if (!how.record || overflowed_) return clear();
  if (room_.answers_lost()) drop_answers();
  PacedStop paced(how.stop);
  counts_.bytes = segments_.capacity() * sizeof(FrontSegment) + neighbours_.pair_bytes();
  for (std::size_t s = 0; s < segments_.size(); ++s) {
    paced.check();
    FrontSegment& segment = segments_[s];
    const bool built = segment.size == 0;
    const bool reused = !built && action_of(segment, near[s].rests, how.answers) == SegmentAction::kReuse;
    counts_.bytes += (reused ? sums_of(segment.chunks, how.stop) : rebalance(segment, how.stop)).bytes;
  }
}

template <class Bounds>
void Front<Bounds>::drop_answers() {
  for (FrontSegment& segment : segments_) {
    for (FrontChunk& chunk : segment.chunks) chunk.kept = {};
  }
  neighbours_.forget_answers();
  keeps_answers_ = false;
  steps_without_them_ = 0;
}

template <class Bounds>
void Front<Bounds>::clear() {
  std::vector<FrontSegment>().swap(segments_);  // with its capacity: of many near parts it is large
  neighbours_.clear();
  size_ = counts_.bytes = 0;
  keeps_answers_ = true;
}

// A segment as before its first build.
template <class Bounds>
void Front<Bounds>::forget(FrontSegment& segment) {
  segment.clear();
  if (segment.with_itself()) neighbours_.forget(segment.parts.a);
}

template <class Bounds>
void Front<Bounds>::forget(PartId part) {
  for (FrontSegment& segment : segments_) {
    if (segment.parts.a != part && segment.parts.b != part) continue;
    size_ -= segment.size;
    forget(segment);
  }
}

template <class Bounds>
void Front<Bounds>::forget(std::span<const std::uint8_t> marked) noexcept {
  for (FrontSegment& segment : segments_) {
    if (marked[number_of(segment.parts.a)] == 0 && marked[number_of(segment.parts.b)] == 0) continue;
    size_ -= segment.size;
    forget(segment);
  }
}

template <class Bounds>
std::vector<NodePair> Front<Bounds>::pairs() const {
  std::vector<NodePair> pairs;
  pairs.reserve(size_);
  for (const FrontSegment& segment : segments_) {
    for (const FrontChunk& chunk : segment.chunks)
      std::ranges::transform(chunk.pairs, std::back_inserter(pairs), &FrontPair::nodes);
  }
  return pairs;
}

template <class Bounds>
std::size_t Front<Bounds>::pair_bytes() const {
  if (segments_.empty()) return 0;
  std::size_t bytes = segments_.capacity() * sizeof(FrontSegment);
  for (const FrontSegment& segment : segments_) {
    for (const FrontChunk& chunk : segment.chunks) bytes += chunk.memory_bytes();
  }
  return bytes + neighbours_.pair_bytes();
}

template <class Bounds>
std::size_t Front<Bounds>::memory_bytes() const {
  std::size_t bytes = pair_bytes();
  bytes += sizeof(Impl) + (impl_->works.capacity() + impl_->first.capacity()) * sizeof(Work) +
           neighbours_.memory_bytes() - neighbours_.pair_bytes();
  // What is room only depends on how it came about. The allocator rounds up, by up to 15 bytes.
  constexpr std::size_t kOfSegment = 16, kOfChunk = 32;
  for (const FrontSegment& segment : segments_)
    bytes += kOfSegment + segment.chunks.size() * kOfChunk + held_bytes(segment.costs) +
             (segment.chunks.capacity() - segment.chunks.size()) * sizeof(FrontChunk);
  for (const ChunkScratch& scratch : impl_->scratch)
    bytes += scratch.pairs.capacity() * sizeof(FrontPair) + scratch.kept.memory_bytes() +
             scratch.found.contacts.capacity() * sizeof(Contact);
  return bytes;
}

template class Front<Aabb>;
template class Front<KDop18>;

}  // namespace warmfront

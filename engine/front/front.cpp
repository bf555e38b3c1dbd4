// SPDX-License-Identifier: Apache-2.0
// The front from step to step, and its storage: segments of chunks of about equal size, in order.
#include "engine/front/front.h"

#include <tbb/blocked_range.h>
#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <iterator>
#include <numeric>
#include <utility>

#include "engine/front/build_tasks.h"
#include "engine/front/chunk_update.h"

namespace warmfront {
namespace {

// Chunks are the unit of work, so none may be much larger than the others, and few much smaller. Chunks that
// are left as they are only change hands.
void rebalance(FrontSegment& segment) {
  constexpr std::size_t kPairs = FrontChunk::kPairs;
  auto& chunks = segment.chunks;
  const auto too_large = [](const FrontChunk& chunk) { return chunk.pairs.size() > 2 * kPairs; };
  if (chunks.size() < 4 + 4 * (segment.size / kPairs) && std::ranges::none_of(chunks, too_large)) return;
  std::vector<FrontChunk> balanced;
  balanced.reserve(segment.size / (kPairs / 2) + 1);
  const auto append = [&](const FrontChunk& from, std::size_t begin, std::size_t end, FrontChunk& to) {
    const auto shift = static_cast<std::uint32_t>(to.pairs.size() - begin);  // modulo 2^32
    to.pairs.insert(to.pairs.end(), from.pairs.begin() + static_cast<std::ptrdiff_t>(begin),
                    from.pairs.begin() + static_cast<std::ptrdiff_t>(end));
    auto contacts = from.kept.contacts.begin();
    for (const KeptAnswers::OfPair& kept : from.kept.pairs) {
      const auto next = contacts + kept.contacts;
      if (kept.pair >= begin && kept.pair < end) {
        to.kept.pairs.push_back({kept.pair + shift, kept.triangle_pairs, kept.contacts, kept.tally});
        to.kept.contacts.insert(to.kept.contacts.end(), contacts, next);
      }
      contacts = next;
    }
    to.find_nodes();
  };
  for (FrontChunk& chunk : chunks) {
    if (too_large(chunk)) {
      for (std::size_t i = 0; i < chunk.pairs.size(); i += kPairs)
        append(chunk, i, std::min(i + kPairs, chunk.pairs.size()), balanced.emplace_back());
    } else if (!balanced.empty() && balanced.back().pairs.size() + chunk.pairs.size() <= kPairs) {
      append(chunk, 0, chunk.pairs.size(), balanced.back());
    } else if (!chunk.pairs.empty()) {
      balanced.push_back(std::move(chunk));
    }
  }
  chunks = std::move(balanced);
}

/// Answers for which there was no room are not kept for so many steps; then the front is built again.
constexpr std::size_t kTryAgain = 256;

// What was found at rest no longer holds.
void test_moved(PartId part, NeighbourChunk& chunk, LeafPairSink& sink) {
  chunk.at_rest = {};
  sink.neighbours(part, chunk);
}

}  // namespace

/// What one task does: builds a chunk below a pair, updates a chunk, or one of neighbours, or hands over what
/// a segment keeps.
template <class Bounds>
struct Front<Bounds>::Work {
  enum Kind : std::uint8_t { kBuild, kUpdate, kNeighbours, kReuse } kind;
  std::size_t segment;
  std::size_t chunk;
  Answers answers;
  BuildTask task{};
};

template <class Bounds>
struct Front<Bounds>::Impl {
  tbb::enumerable_thread_specific<ChunkScratch> scratch;
  std::vector<Work> works;  // of the step
};

template <class Bounds>
Front<Bounds>::Front() : impl_(std::make_unique<Impl>()) {}
template <class Bounds>
Front<Bounds>::~Front() = default;

template <class Bounds>
void Front<Bounds>::match(std::span<const NearPair> near, StopSignal stop) {
  if (std::ranges::equal(segments_, near, {}, &FrontSegment::parts, &NearPair::parts)) return;
  std::vector<FrontSegment> matched;
  matched.reserve(near.size());
  auto old = segments_.begin();
  PacedStop paced(stop);
  for (const NearPair& pair : near) {
    paced.check();
    for (; old != segments_.end() && old->parts < pair.parts; ++old) forget(*old);
    if (old != segments_.end() && old->parts == pair.parts)
      matched.push_back(std::move(*old++));
    else
      matched.emplace_back().parts = pair.parts;
  }
  for (; old != segments_.end(); ++old) forget(*old);
  segments_ = std::move(matched);
}

template <class Bounds>
void Front<Bounds>::plan(std::span<const Bvh<Bounds>> trees, std::span<const NearPair> near,
                         const FrontUpdate& how) {
  // A task is worth its own only above a share of the whole, and above some work.
  constexpr double kShare = 1.0 / 256;
  constexpr double kLeastCost = 32;
  const auto pair_of = [&](const FrontSegment& s) {
    return TreePair<Bounds>(trees[number_of(s.parts.a)], trees[number_of(s.parts.b)], how.gap_at,
                            how.widths.of(s.parts));
  };
  double cost = 0;
  PacedStop paced(how.stop, 256);
  for (const FrontSegment& segment : segments_) {
    paced.check();
    if (segment.chunks.empty()) cost += build_cost(pair_of(segment), Bvtt::root());
  }
  std::vector<Work>& work = impl_->works;
  work.clear();
  for (std::size_t s = 0; s < segments_.size(); ++s) {
    paced.check();
    FrontSegment& segment = segments_[s];
    bool listed = false;  // the segment's neighbours, just now
    const SegmentAction action = action_of(segment, near[s].rests, how.answers);
    if (action != SegmentAction::kBuild) ++updated_;
    switch (action) {
      case SegmentAction::kBuild: {
        forget(segment);
        const auto tasks = decompose(pair_of(segment), std::max(kShare * cost, kLeastCost), counts_.bv_tests);
        segment.chunks.resize(tasks.size());
        for (std::size_t c = 0; c < tasks.size(); ++c)
          work.push_back({Work::kBuild, s, c, how.answers, tasks[c]});
        break;
      }
      case SegmentAction::kReuse:
        counts_.rested += segment.size;
        room_.take_pairs(segment.size);
        if (std::ranges::any_of(segment.chunks, [](const FrontChunk& c) { return !c.kept.empty(); }))
          work.push_back({Work::kReuse, s, 0, how.answers});
        break;
      case SegmentAction::kUpdate: {
        listed =
            segment.with_itself() && list_neighbours(segment.parts.a, trees[number_of(segment.parts.a)], how);
        const Answers answers = listed ? answers_after_listing(how.answers) : how.answers;
        for (std::size_t c = 0; c < segment.chunks.size(); ++c)
          work.push_back({Work::kUpdate, s, c, answers});
        break;
      }
    }
    if (!segment.with_itself()) continue;
    const Bvh<Bounds>& tree = trees[number_of(segment.parts.a)];
    const std::span<const NeighbourChunk> neighbours = std::as_const(neighbours_).of(segment.parts.a);
    // A list begins with a chunk for each subtree. No subtree's was tested before it was listed.
    const std::size_t subtrees = how.subtrees_tested && !listed ? tree.shape.subtree_count() : 0;
    for (std::size_t c = 0; c < neighbours.size(); ++c) {
      if (c < subtrees && tree.subtree_changed(static_cast<std::uint32_t>(c))) continue;
      if (action != SegmentAction::kReuse || neighbours[c].may_have_contacts)
        work.push_back({Work::kNeighbours, s, c, how.answers});
    }
  }
}

// Lists a part's neighbours at its segment's first update, since many a front is never updated. Not where
// pairs would soon lack the room: a front that is dropped because of its neighbours is built anew without
// them, again and again.
template <class Bounds>
bool Front<Bounds>::list_neighbours(PartId part, const Bvh<Bounds>& tree, const FrontUpdate& how) {
  const std::size_t room_to_grow = size_ * sizeof(FrontPair) * 2;
  const std::size_t room = how.max_bytes - std::min(room_to_grow, how.max_bytes);
  return how.lazy && neighbours_.list(part, tree, room, how.stop);
}

template <class Bounds>
void Front<Bounds>::run(const Work& work, std::span<const Bvh<Bounds>> trees, LeafPairSink& sink,
                        const FrontUpdate& how) {
  how.stop.check();
  FrontSegment& segment = segments_[work.segment];
  const PartPair& parts = segment.parts;
  const TreePair<Bounds> pair(trees[number_of(parts.a)], trees[number_of(parts.b)], how.gap_at,
                              how.widths.of(parts));
  switch (work.kind) {
    case Work::kReuse:
      for (const FrontChunk& chunk : segment.chunks) reuse(chunk, sink, how.stop);
      break;
    case Work::kNeighbours:
      run_neighbours(pair.a, parts.a, neighbours_.of(parts.a)[work.chunk], sink, how.wider, work.answers);
      break;
    case Work::kBuild:
    case Work::kUpdate:
      update(work, pair, sink, how);
  }
}

// Builds or updates a chunk.
template <class Bounds>
void Front<Bounds>::update(const Work& work, const TreePair<Bounds>& trees, LeafPairSink& sink,
                           const FrontUpdate& how) {
  const FrontSegment& segment = segments_[work.segment];
  FrontChunk& chunk = segments_[work.segment].chunks[work.chunk];
  ChunkScratch& scratch = impl_->scratch.local();
  if (work.kind == Work::kUpdate && action_of(chunk, trees, how.prune, work.answers) == ChunkAction::kReuse) {
    reuse(chunk, sink, how.stop);
    scratch.counts.rested += chunk.pairs.size();
    room_.take_pairs(chunk.pairs.size());
    return;
  }
  const bool skip_neighbours = segment.with_itself() && neighbours_.listed(segment.parts.a);
  ChunkUpdate<Bounds> update(trees, segment.parts, skip_neighbours, sink, how, work.answers, room_, scratch);
  if (work.kind == Work::kBuild) {
    update.build(work.task.pair, work.task.gap);
    return store(chunk);
  }
  if (update.run(chunk)) return store(chunk);
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
  const std::vector<Work>& works = impl_->works;
  room_.allow(how.record ? how.max_bytes - neighbours_.list_bytes() : 0);
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, works.size(), 1), [&](const auto& range) {
    const StageClock::In front(sinks.clock(), Stage::kFront);
    LeafPairSink& sink = sinks.local();
    for (std::size_t i = range.begin(); i < range.end(); ++i) run(works[i], trees, sink, how);
  });
  for (const ChunkScratch& scratch : impl_->scratch) counts_.add(scratch.counts);
  size_ = room_.pairs();
  overflowed_ = how.record && room_.pairs_lost();
  if (!how.record || overflowed_) return clear();
  if (room_.answers_lost()) drop_answers();
  PacedStop paced(how.stop);
  for (std::size_t s = 0; s < segments_.size(); ++s) {
    paced.check();
    FrontSegment& segment = segments_[s];
    const bool built = segment.size == 0;
    if (!built && action_of(segment, near[s].rests, how.answers) == SegmentAction::kReuse) continue;
    segment.size = 0;
    for (const FrontChunk& chunk : segment.chunks) segment.size += chunk.pairs.size();
    rebalance(segment);
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
void Front<Bounds>::settle(std::span<const Bvh<Bounds>> trees, const PartWidths& widths) noexcept {
  for (FrontSegment& segment : segments_) {
    const TreePair<Bounds> pair_of(trees[number_of(segment.parts.a)], trees[number_of(segment.parts.b)],
                                   GapAt::kEnd, widths.of(segment.parts));
    const Bvh<Bounds>& a = pair_of.a;
    const Bvh<Bounds>& b = pair_of.b;
    if (a.travel.nodes.empty() || b.travel.nodes.empty()) continue;
    const std::uint32_t reserve = pair_of.reserve();
    for (FrontChunk& chunk : segment.chunks) {
      for (FrontPair& pair : chunk.pairs) {
        const NodeTravel& at_a = a.travel.nodes[number_of(pair.nodes.a)];
        const NodeTravel& at_b = b.travel.nodes[number_of(pair.nodes.b)];
        if (pair.budget.exhausted(at_a, at_b, reserve)) pair.budget.spend(at_a, at_b);
      }
    }
    if (segment.with_itself()) neighbours_.settle(segment.parts.a, a.travel.blocks, reserve);
  }
}

template <class Bounds>
void Front<Bounds>::leave_trial(std::span<const Bvh<Bounds>> trees, std::span<const std::uint8_t> off_base,
                                TrialLeft left, const PartWidths& widths) noexcept {
  for (FrontSegment& segment : segments_) {
    const std::uint32_t p = number_of(segment.parts.a);
    const std::uint32_t q = number_of(segment.parts.b);
    if (off_base[p] == 0 && off_base[q] == 0) continue;
    const TreePair<Bounds> pair_of(trees[p], trees[q], GapAt::kEnd, widths.of(segment.parts));
    if (pair_of.a.travel.nodes.empty() || pair_of.b.travel.nodes.empty()) continue;
    const TrialTravel a = pair_of.a.travel.nodes_of_trial(off_base[p] != 0);
    const TrialTravel b = pair_of.b.travel.nodes_of_trial(off_base[q] != 0);
    const std::uint32_t reserve = pair_of.reserve();
    for (FrontChunk& chunk : segment.chunks) {
      for (FrontPair& pair : chunk.pairs)
        warmfront::leave_trial(pair.budget, a, number_of(pair.nodes.a), b, number_of(pair.nodes.b), left,
                               reserve);
    }
    if (segment.with_itself())
      neighbours_.leave_trial(segment.parts.a, pair_of.a.travel.blocks_of_trial(true), left, reserve);
  }
}

template <class Bounds>
void Front<Bounds>::clear() {
  std::vector<FrontSegment>().swap(segments_);  // with its capacity: of many near parts it is large
  neighbours_.clear();
  size_ = 0;
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
  bytes += sizeof(Impl) + impl_->works.capacity() * sizeof(Work) + neighbours_.memory_bytes() -
           neighbours_.pair_bytes();
  // What is room only depends on how it came about. The allocator rounds up, by up to 15 bytes.
  constexpr std::size_t kOfSegment = 16, kOfChunk = 32;
  for (const FrontSegment& segment : segments_)
    bytes += kOfSegment + segment.chunks.size() * kOfChunk +
             (segment.chunks.capacity() - segment.chunks.size()) * sizeof(FrontChunk);
  for (const ChunkScratch& scratch : impl_->scratch)
    bytes += scratch.pairs.capacity() * sizeof(FrontPair) + scratch.kept.memory_bytes() +
             scratch.found.contacts.capacity() * sizeof(Contact);
  return bytes;
}

template class Front<Aabb>;
template class Front<KDop18>;

}  // namespace warmfront

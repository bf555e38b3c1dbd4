// SPDX-License-Identifier: Apache-2.0
// Which segments the front has in a step, and which tasks bring them up to date.
#include <algorithm>
#include <cstddef>
#include <utility>
#include <vector>

#include "engine/front/actions.h"
#include "engine/front/front_impl.h"
#include "engine/parallel/fork_within.h"

namespace warmfront {

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
  constexpr double kShare = 1.0 / 1024;
  constexpr double kLeastCost = 16;
  // What takes many times as long as others begins first: else all would wait for it at the end. Not among
  // few threads, which seldom wait, and find more in their caches in the pairs' order.
  constexpr std::uint64_t kHeavy = 2;
  constexpr std::size_t kManyChunks = 16;
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
  std::vector<Work>& first = among_many_threads() ? impl_->first : impl_->works;
  work.clear();
  impl_->first.clear();
  std::uint64_t cost_of_chunks = 0, chunks = 0;
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
        if (segment.chunks.size() >= kManyChunks) segment.costs.resize(segment.chunks.size());
        for (std::size_t c = 0; c < segment.chunks.size(); ++c) {
          const std::uint32_t last = segment.costs.empty() ? 0 : segment.costs[c];
          cost_of_chunks += last;
          (last > impl_->heavy ? first : work).push_back({Work::kUpdate, s, c, answers});
        }
        chunks += segment.chunks.size();
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
        first.push_back({Work::kNeighbours, s, c, how.answers});
    }
  }
  impl_->heavy = kHeavy * cost_of_chunks / std::max<std::uint64_t>(chunks, 1);
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

template void Front<Aabb>::match(std::span<const NearPair>, StopSignal);
template void Front<Aabb>::plan(std::span<const Bvh<Aabb>>, std::span<const NearPair>, const FrontUpdate&);
template void Front<KDop18>::match(std::span<const NearPair>, StopSignal);
template void Front<KDop18>::plan(std::span<const Bvh<KDop18>>, std::span<const NearPair>,
                                  const FrontUpdate&);

}  // namespace warmfront

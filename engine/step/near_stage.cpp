// SPDX-License-Identifier: Apache-2.0
#include "engine/step/near_stage.h"

#include <algorithm>
#include <iterator>

#include "engine/front/front.h"
#include "engine/motion/trial_way.h"
#include "engine/scene/held_bytes.h"

namespace warmfront {
namespace {

/// Segments of the front for pairs of parts may take this share of its bytes, besides the pairs in them.
/// Where more parts are near each other than that, or than a block, bodies lie in one place by the thousands:
/// then their pairs are taken in blocks, none of which is kept.
constexpr std::size_t kSegmentsShare = 4;

}  // namespace

template <class Bounds>
std::uint64_t NearStage<Bounds>::find(const Core& core, const PartTrees<Bounds>& trees, Kind kind,
                                      StopSignal stop) {
  const std::size_t most = std::max(NearParts<Bounds>::kBlock, core.options.max_front_bytes / kSegmentsShare /
                                                                   Front<Bounds>::kSegmentBytes);
  std::uint64_t bv_tests = 0;
  const bool rebuild = stale_ || core.options.front == FrontMode::kNone;
  take(core, near_.find(core.model, trees.roots(), trees.states(), rebuild, bv_tests, most, stop));
  if (near_.overflowed()) {
    apart_.forget();
    count_ = 0;
  } else {
    // A trial's planes hold for shorter trials, too, which may take two parts beside its way.
    const double room = kind != Kind::kStep ? kPairBesideTheWay * trees.magnitude() : 0;
    if (separates_)
      apart_.sift(core.motion, core.options, core.thickness, core.arcs, room, stale_, stop, pairs_);
    count_ = pairs_.size();
  }
  stale_ = near_.overflowed();
  return bv_tests;
}

template <class Bounds>
bool NearStage<Bounds>::next_block(const Core& core, const PartTrees<Bounds>& trees, std::uint64_t& bv_tests,
                                   StopSignal stop) {
  const std::span<const NearPair> block = near_.next_block(core.model, trees.states(), bv_tests, stop);
  take(core, block);
  count_ += pairs_.size();
  return !block.empty();
}

template <class Bounds>
void NearStage<Bounds>::take(const Core& core, std::span<const NearPair> near) {
  pairs_.clear();
  std::ranges::copy_if(near, std::back_inserter(pairs_), [&](const NearPair& pair) {
    return pair.parts.a != pair.parts.b || core.tests_itself(pair.parts.a);
  });
}

template <class Bounds>
void NearStage<Bounds>::release() noexcept {
  near_ = {};
  apart_ = {};
  std::vector<NearPair>().swap(pairs_);
}

template <class Bounds>
std::size_t NearStage<Bounds>::memory_bytes() const {
  return near_.memory_bytes() + apart_.memory_bytes() + held_bytes(pairs_);
}

template class NearStage<Aabb>;
template class NearStage<KDop18>;

}  // namespace warmfront

// SPDX-License-Identifier: Apache-2.0
#include "engine/step/front_stage.h"

#include <utility>

#include "engine/state/part_trees.h"

namespace warmfront {
namespace {

/// A lazy front looks for pairs to fold every this many steps: a pair that could be folded costs a compare a
/// step, looking whether it can costs a test.
constexpr std::int64_t kLazyPruneSteps = 8;

}  // namespace

template <class Bounds>
FrontState FrontStage<Bounds>::update(std::span<const Bvh<Bounds>> trees, std::span<const NearPair> near,
                                      NarrowPhase<Bounds>& narrow, const FrontInput& input,
                                      bool new_hierarchy) {
  const ColliderOptions& options = input.options;
  const bool keep = options.front != FrontMode::kNone;
  const bool first = steps_since_build_ < 0;
  const bool update = keep && !lost_ && !due_for_rebuild(options);
  if (!update) front_.clear();
  const std::size_t before = front_.size();
  steps_since_build_ = update ? steps_since_build_ + 1 : 0;
  const bool lazy = is_lazy(options);
  const bool prune =
      options.front == FrontMode::kWarm && (!lazy || steps_since_build_ % kLazyPruneSteps == 0);
  front_.advance(trees, near, narrow,
                 {.prune = prune,
                  .lazy = lazy,
                  .record = keep,
                  .answers = answers(options),
                  .widths = input.widths,
                  .fold_widths = input.fold_widths,
                  .wider = input.wider,
                  .subtrees_tested = true,
                  .gap_at = input.gap_at,
                  .max_bytes = options.max_front_bytes,
                  .stop = input.stop});
  lost_ = front_.overflowed();
  stalled_steps_ = !update || front_.size() > before ? 0 : stalled_steps_ + 1;
  if (!keep) return FrontState::kNone;
  if (front_.overflowed()) return FrontState::kCapped;
  if (first) return FrontState::kBuilt;
  return update && !new_hierarchy ? FrontState::kUpdated : FrontState::kRebuilt;
}

template <class Bounds>
FrontState FrontStage<Bounds>::begin_without(const ColliderOptions& options) {
  front_.clear();
  steps_since_build_ = stalled_steps_ = 0;
  lost_ = true;
  return options.front == FrontMode::kNone ? FrontState::kNone : FrontState::kCapped;
}

template <class Bounds>
std::uint64_t FrontStage<Bounds>::traverse(std::span<const Bvh<Bounds>> trees, std::span<const NearPair> near,
                                           NarrowPhase<Bounds>& narrow, const FrontInput& input) {
  front_.advance(trees, near, narrow,
                 {.prune = false,
                  .record = false,
                  .answers = Answers::kForget,
                  .widths = input.widths,
                  .gap_at = input.gap_at,
                  .max_bytes = 0,
                  .stop = input.stop});
  return front_.counts().bv_tests;
}

// What was lost stays so until a step was completed without it.
template <class Bounds>
Rebuild FrontStage<Bounds>::reason_of(FrontState state) {
  if (state == FrontState::kCapped) lost_to_ = Rebuild::kCapped;
  if (state != FrontState::kRebuilt) return Rebuild::kNone;
  const Rebuild lost = std::exchange(lost_to_, Rebuild::kNone);
  if (lost != Rebuild::kNone) return lost;
  return steps_since_build_ == 0 ? Rebuild::kPolicy : Rebuild::kDecayed;
}

template <class Bounds>
void FrontStage<Bounds>::lose(Rebuild why) noexcept {
  lost_to_ = why;
  front_.clear();
  lost_ = true;
}

template <class Bounds>
Answers FrontStage<Bounds>::answers(const ColliderOptions& options) const {
  if (retests(options)) return Answers::kForget;
  return answers_hold_ ? Answers::kReuse : Answers::kRenew;
}

// The paper's deferred rebuild (section 4.3), or every K steps (its section 8).
template <class Bounds>
bool FrontStage<Bounds>::due_for_rebuild(const ColliderOptions& options) const {
  if (options.front != FrontMode::kPaper) return false;
  const auto due = [](std::uint32_t limit, std::int64_t count) { return limit > 0 && count >= limit; };
  return due(options.rebuild_after_stalled_steps, stalled_steps_) ||
         due(options.rebuild_every_steps, steps_since_build_ + 1);
}

template class FrontStage<Aabb>;
template class FrontStage<KDop18>;

}  // namespace warmfront

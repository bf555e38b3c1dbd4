// SPDX-License-Identifier: Apache-2.0
#include "engine/step/refit_stage.h"

#include "engine/parallel/fork_join.h"

namespace warmfront {

template <class Bounds>
void RefitStage<Bounds>::refit_placed(ApartParts* apart, bool rebuild) {
  trees_.begin_refits();
  fork_range(std::uint32_t{0}, core_.motion.part_count(), 1, [&](const auto& range) {
    const StageClock::In refitting(narrow_.clock(), Stage::kRefit);
    for (PartId part{range.begin()}; part < PartId{range.end()}; ++part) {
      stop_.check();
      if (trees_.wait(core_, part, apart, rebuild)) continue;
      refit(part);
      trees_.take_root(core_, part, rebuild);
    }
  });
  trees_.all_placed();
}

template <class Bounds>
void RefitStage<Bounds>::refit_near(std::span<const NearPair> near) {
  const std::span<const PartId> parts = trees_.waiting(near, stop_);
  fork_range(std::size_t{0}, parts.size(), 1, [&](const auto& range) {
    const StageClock::In refitting(narrow_.clock(), Stage::kRefit);
    for (std::size_t i = range.begin(); i < range.end(); ++i) {
      stop_.check();
      if (core_.motion.unplaced(parts[i])) core_.motion.place(parts[i], stop_);
      refit(parts[i]);
    }
  });
  trees_.leave_waiting();
}

template <class Bounds>
void RefitStage<Bounds>::refit(PartId part) {
  const bool tests_neighbours = core_.tests_itself(part) && front_.neighbours().listed(part);
  const Refit<Bounds> refit = trees_.begin_refit(core_, part, stop_);
  for_subtrees(refit.subtree_count(), [&](std::uint32_t subtree) {
    const StageClock::In refitting(narrow_.clock(), Stage::kRefit);
    if (!refit.refit_subtree(subtree) || !tests_neighbours) return;
    stop_.check();
    const StageClock::In testing(narrow_.clock(), Stage::kFront);
    front_.test_subtree(part, subtree, narrow_.local());
  });
  trees_.finish_refit(part, refit);
}

template class RefitStage<Aabb>;
template class RefitStage<KDop18>;

}  // namespace warmfront

// SPDX-License-Identifier: Apache-2.0
#include "engine/step/longest_trial.h"

#include <optional>
#include <utility>

namespace warmfront {
namespace {

// Are all vertices placed, and do all move along lines, none one by one? Few that move cost little anyway.
bool all_move_as_a_whole(const Core& core) {
  if (core.arcs.any()) return false;  // on arcs no motion is part of a longer one's lines
  for (std::uint32_t p = 0; p < core.motion.part_count(); ++p) {
    const bool moves = (core.motion.state(PartId{p}) & kMoving) != 0;
    if (moves && (core.motion.unplaced(PartId{p}) || core.motion.range(PartId{p}).listed)) return false;
  }
  return true;
}

}  // namespace

bool LongestTrial::contains_motion(Core& core, double magnitude, StopSignal stop) {
  if (core.motion.from() != From::kStart || !way_.known()) return false;
  const Motion& vertices = core.motion.vertices();
  if (vertices.magnitude() != magnitude || !serves(core.options, core.keep)) return false;
  for (std::uint32_t p = 0; p < core.motion.part_count(); ++p) {
    if (core.motion.unplaced(PartId{p}) && (core.motion.state(PartId{p}) & kMoving) != 0)
      core.motion.place(PartId{p}, stop);
  }
  if (!all_move_as_a_whole(core)) return false;
  const std::optional<double> fraction = way_.fraction_of(vertices, magnitude, stop);
  if (!fraction || *fraction > until_) return false;
  fraction_ = *fraction;
  shortened_ = true;
  return true;
}

bool LongestTrial::begin_other() {
  way_.forget();
  return std::exchange(shortened_, false);
}

void LongestTrial::remember(const Core& core, const Found& found, StopSignal stop) {
  if (!all_move_as_a_whole(core)) return;
  way_.take(core.motion.vertices(), stop);
  asked_ = core.options;
  keep_ = core.keep;
  found_ = found;
  until_ = 0;
}

// What is left out as it meets nothing may be tangled all the same (RigidParts::look()).
bool LongestTrial::serves(const ColliderOptions& now, const KeepDistance& keep) const {
  constexpr PairTest kTangles = PairTest::kIntersection;
  const bool same_reach = now.tier == asked_.tier && now.tolerance == asked_.tolerance &&
                          now.min_separation == asked_.min_separation &&
                          reports_by_distance(now) == reports_by_distance(asked_) &&
                          (now.pair_test == kTangles) == (asked_.pair_test == kTangles);
  const bool same_answer = same_reach && now.report == asked_.report &&
                           now.leave_out_overlaps == asked_.leave_out_overlaps && keep == keep_ &&
                           now.room_for == asked_.room_for && now.pair_test == asked_.pair_test &&
                           now.instant == asked_.instant;
  // Of a narrower one not all was met that a wider one asks about.
  return now.min_separation <= asked_.min_separation && (same_reach || !found_.left_out) &&
         (same_answer || !found_.kept);
}

}  // namespace warmfront

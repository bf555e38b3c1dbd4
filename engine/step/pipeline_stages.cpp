// SPDX-License-Identifier: Apache-2.0
// The stages of a question, in order, from where its motion has begun to its answer.
#include <algorithm>
#include <cstdint>
#include <limits>

#include "engine/parallel/stoppable_loops.h"
#include "engine/step/bodies_within.h"
#include "engine/step/contact_fields.h"
#include "engine/step/patch_stage.h"
#include "engine/step/pipeline_with.h"
#include "engine/step/widest_separation.h"

namespace warmfront {

template <class Bounds>
NarrowPhaseOutput PipelineWith<Bounds>::run(Core& core, SceneMotion::Step& motion, const Frame& frame,
                                            StopSignal stop, StepStatistics& statistics) {
  StepTimer timer(statistics.ms);
  statistics.bounds = bounds();
  arranged_ = false;
  kind_ == Kind::kAgain ? motion.begin_again() : motion.begin(frame, stop);
  core.arcs.take(core.model.screws(), core.topology->scene.body_of_vertex(), core.motion, stop);
  if (core.options.room_for)
    core.room.take(*core.options.room_for, core.motion, core.model, core.topology->scene.body_of_vertex(),
                   stop);
  else
    core.room.forget();
  if (core.keep.share > 0 || core.room.any()) take_widest_separation(core, stop);
  take_width(core);
  begin_vertex_distances(core, stop);
  const bool shorter = is_question() && longest_.contains_motion(core, trees_.magnitude(), stop);
  return shorter ? run_shorter(core, stop, statistics, timer) : run_stages(core, stop, statistics, timer);
}

template <class Bounds>
void PipelineWith<Bounds>::take_widest_separation(Core& core, StopSignal stop) {
  const double widest = narrowed_separation(core, widest_separation(core, stop));
  if (widest != core.asked_separation) options_changed(core);
  core.options.min_separation = core.asked_separation = widest;
}

template <class Bounds>
void PipelineWith<Bounds>::begin_vertex_distances(Core& core, StopSignal stop) {
  if (core.options.report != Report::kVertexDistances) return;
  std::vector<double>& distances = core.found().vertex_distances;
  distances.clear();
  lengthen(distances, core.scene->vertex_count(), core.options.min_separation, stop);
}

template <class Bounds>
void PipelineWith<Bounds>::take_width(const Core& core) {
  const double held = widths_.held();
  widths_.begin(core.options.min_separation);
  part_widths_ = part_widths(core, core.options.min_separation);
  fold_widths_ = part_widths(core, widths_.held());
  if (widths_.held() == held) return;
  trees_.hold(widths_.held());
  near_.forget();
}

template <class Bounds>
NarrowPhaseOutput PipelineWith<Bounds>::run_stages(Core& core, StopSignal stop, StepStatistics& statistics,
                                                   StepTimer& timer) {
  StepCounts& counts = statistics.counts;
  begin_question(core, stop);
  const bool new_hierarchy = arrange(core, stop);
  counts.cone_patches = cull_patches(core, stop);
  const NarrowPhaseInput input = narrow_input(core, stop, is_question());
  narrow_.begin(trees_.trees(), input);
  timer.add(&StageTimes::refit);

  RefitStage<Bounds> refit(core, trees_, front_.front(), narrow_, stop);
  refit.refit_placed(near_.apart(), near_.stale());
  timer.share(narrow_.take_times(), &StageTimes::refit);
  counts.bv_tests = near_.find(core, trees_, kind_, stop);
  timer.add(&StageTimes::refit);
  refit.refit_near(near_.pairs());
  timer.share(narrow_.take_times(), &StageTimes::refit);

  turning_.take(core, near_.pairs(), stop);
  counts.bv_tests += turning_.run(core, trees_.trees(), narrow_, stop);
  if (near_.overflowed()) {
    statistics.front_state = traverse_in_blocks(core, refit, input, counts.bv_tests);
  } else {
    statistics.front_state = front_.update(trees_.trees(), turning_.others(near_.pairs()), narrow_,
                                           front_input(core, stop), new_hierarchy);
    counts.bv_tests += front_.front().counts().bv_tests;
  }
  trees_.take_looseness();
  statistics.rebuild = front_.reason_of(statistics.front_state);
  narrow_.flush();
  if (is_question()) remember_trial(core, stop);
  timer.share(narrow_.take_times(), &StageTimes::front);

  const NarrowPhaseOutput output = answer(core, trees_.roots(), stop, timer);
  add(counts, output.counts);
  count_front(counts);
  count_parts(core, counts);
  return output;
}

template <class Bounds>
NarrowPhaseOutput PipelineWith<Bounds>::run_shorter(Core& core, StopSignal stop, StepStatistics& statistics,
                                                    StepTimer& timer) {
  StepCounts& counts = statistics.counts;
  arranged_ = true;
  statistics.part_of_trial = true;
  statistics.front_state = core.options.front == FrontMode::kNone ? FrontState::kNone : FrontState::kUpdated;
  trees_.bound_vertices(core, stop);
  counts.cone_patches = cull_patches(core, stop);
  const NarrowPhaseInput input = narrow_input(core, stop, false);
  narrow_.begin(trees_.trees(), input);
  timer.add(&StageTimes::refit);

  narrow_.test_met();
  timer.share(narrow_.take_times(), &StageTimes::front);

  // Roots are those of the longest trial, and half-spaces may move beside its way.
  const NarrowPhaseOutput output = answer(core, {}, stop, timer);
  add(counts, output.counts);
  counts.front_bytes = front_.front().pair_bytes();
  count_parts(core, counts);
  return output;
}

template <class Bounds>
NarrowPhaseOutput PipelineWith<Bounds>::answer(Core& core, std::span<const Bounds> roots, StopSignal stop,
                                               StepTimer& timer) {
  if (!core.model.half_spaces().empty()) {
    half_spaces_.run(core, roots, narrow_, stop);
    timer.add(&StageTimes::elementary);
  }
  orphans_.run(core, narrow_, retests(core.options), stop);
  timer.add(&StageTimes::adjacent);
  const NarrowPhaseOutput output = narrow_.finish(core.found().contacts);
  take_world_tois(core);
  reduced_rows_.run(core, stop);
  compute_contact_fields(core, stop);
  timer.add(&StageTimes::elementary);
  return output;
}

template <class Bounds>
void PipelineWith<Bounds>::take_world_tois(Core& core) {
  std::vector<double>& tois = core.found().world_tois;
  tois.clear();
  if (core.options.report != Report::kEarliest) return;
  for (std::uint32_t world = 0; world < core.worlds.numbers().size(); ++world) {
    const double toi = narrow_.earliest_in(world);
    tois.push_back(toi <= 1 ? toi : std::numeric_limits<double>::infinity());
  }
}

template <class Bounds>
void PipelineWith<Bounds>::begin_question(Core& core, StopSignal stop) {
  if (core.motion.from() == From::kStart) leave_trial(core, TrialLeft::kForBase);
  budgets_.begin(core.motion, is_question());
  if (longest_.begin_other()) {
    trees_.forget_bounds_of_moved();
    near_.forget();
  }
  unseen_places_ = false;
  trees_.begin_step(core.motion.from(), is_question());
  front_.front().begin_step();
  // Where the motion begins an arc leaves nothing its line, so that what was promised there is no promise.
  if (widths_.unsettled() || core.arcs.any()) {
    trees_.return_to_base();
    front_.front().settle(trees_.trees(), part_widths_);
    widths_.settle();
  }
  forget_outliers(core);
  core.rigid_parts.look(*core.topology, core.motion, core.model, core.options, core.thickness, core.workers,
                        &bodies_within, is_question(), stop);
  near_.begin(core);
}

template <class Bounds>
void PipelineWith<Bounds>::forget_outliers(Core& core) {
  if (!(core.motion.vertices().magnitude() < trees_.magnitude())) return;
  forget_steps(core, Rebuild::kDecayed);
  trees_.clear();
}

template <class Bounds>
bool PipelineWith<Bounds>::arrange(const Core& core, StopSignal stop) {
  const std::size_t arranged = trees_.arrange_new(core, near_.stale(), stop);
  if (arranged > 0) near_.forget();
  if (trees_.some_changed()) {
    trees_.return_to_base();  // whose travel budgets are of
    trees_.take_changed([&](PartId part, std::span<const std::uint8_t> blocks) {
      front_.front().follow(part, trees_.trees(), blocks, core.options.max_front_bytes, stop);
    });
  }
  const std::span<const PartId> rearranged = trees_.rearrange_loose(core, stop);
  for (const PartId part : rearranged) front_.front().forget(part);
  if (trees_.take_magnitude(core.motion.vertices().magnitude())) {
    near_.forget();
    // Bounds of what rests are other ones, too: pairs that were apart by the last ones may overlap by these.
    front_.forget_answers();
  }
  arranged_ = true;
  return (arranged > 0 && arranged == trees_.trees().size()) || !rearranged.empty();
}

template <class Bounds>
FrontState PipelineWith<Bounds>::traverse_in_blocks(Core& core, RefitStage<Bounds>& refit,
                                                    const NarrowPhaseInput& input, std::uint64_t& bv_tests) {
  const FrontState state = front_.begin_without(core.options);
  narrow_.begin(trees_.trees(), input);
  while (near_.next_block(core, trees_, bv_tests, input.stop)) {
    refit.refit_near(near_.pairs());
    bv_tests += front_.traverse(trees_.trees(), near_.pairs(), narrow_, front_input(core, input.stop));
  }
  return state;
}

template <class Bounds>
void PipelineWith<Bounds>::remember_trial(const Core& core, StopSignal stop) {
  if (!narrow_.knows_met()) return;
  const bool left_out = core.rigid_parts.count() > 0 || !near_.apart_pairs().empty();
  // Of pairs that rest only the answers are kept, not which pairs met: another question may ask about
  // these.
  const bool kept = narrow_.met_kept() || front_.front().counts().rested > 0;
  longest_.remember(core, {.left_out = left_out, .kept = kept}, stop);
}

template <class Bounds>
NarrowPhaseInput PipelineWith<Bounds>::narrow_input(Core& core, StopSignal stop, bool note_met) const {
  return {core.topology->scene,
          core.topology->numbering,
          core.topology->ownership,
          core.filter,
          core.thickness,
          core.arcs,
          core.worlds,
          core.topology->patches,
          core.patch_culled,
          core.motion.vertices().vertices(),
          core.motion.vertices().states(),
          core.vertex_bounds,
          core.options,
          stop,
          budgets_.gap_at(),
          note_met,
          core.keep,
          core.keep.share > 0 ? beyond_with_room(core) : 0,
          part_widths_,
          core.found().vertex_distances,
          !core.model.half_spaces().empty(),
          core.room.any() ? &core.room : nullptr,
          core.window.until()};
}

template <class Bounds>
void PipelineWith<Bounds>::count_front(StepCounts& counts) const {
  const FrontCounts& front = front_.front().counts();
  counts.front_skipped = front.skipped;
  counts.front_rested = front.rested;
  counts.front_sprouted = front.sprouted;
  counts.front_pruned = front.pruned;
  counts.front_bytes = front.bytes;
  counts.nodes_refit = trees_.refit_nodes();
}

template <class Bounds>
void PipelineWith<Bounds>::count_parts(const Core& core, StepCounts& counts) const {
  counts.adjacent_pairs = core.topology->adjacent_pairs;
  counts.front_pairs = front_.front().size();
  counts.vertices_moved = core.motion.moved_vertices();
  counts.parts_moved = static_cast<std::uint64_t>(
      std::ranges::count_if(trees_.states(), [](MotionState state) { return (state & kMoving) != 0; }));
  counts.parts = core.model.part_count();
  counts.parts_rigid = core.rigid_parts.count();
  counts.near_parts = near_.count();
  counts.parts_apart = near_.apart_pairs().size();
  counts.part_pairs_excluded = core.excluded_pairs;
}

template NarrowPhaseOutput PipelineWith<Aabb>::run(Core&, SceneMotion::Step&, const Frame&, StopSignal,
                                                   StepStatistics&);
template NarrowPhaseOutput PipelineWith<KDop18>::run(Core&, SceneMotion::Step&, const Frame&, StopSignal,
                                                     StepStatistics&);

}  // namespace warmfront

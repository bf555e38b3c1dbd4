// SPDX-License-Identifier: Apache-2.0
// The pipeline with one kind of bounds. What its callers ask of it is in pipeline.cpp, the stages of a
// question in pipeline_stages.cpp. Used by one thread at a time.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <type_traits>
#include <vector>

#include "engine/narrow_phase/narrow_phase.h"
#include "engine/state/part_trees.h"
#include "engine/step/asked_widths.h"
#include "engine/step/front_stage.h"
#include "engine/step/granted_budgets.h"
#include "engine/step/half_space_stage.h"
#include "engine/step/longest_trial.h"
#include "engine/step/near_stage.h"
#include "engine/step/orphan_stage.h"
#include "engine/step/pipeline.h"
#include "engine/step/reduced_rows.h"
#include "engine/step/refit_stage.h"
#include "engine/step/step_load.h"
#include "engine/step/step_timer.h"
#include "engine/step/turning_stage.h"

namespace warmfront {

template <class Bounds>
class PipelineWith final : public Pipeline {
 public:
  Result<StepResult> step(Core& core, const Frame& frame, Kind kind, StopSignal stop,
                          const AcceptStep& accept) override;
  void commit(Core& core, double fraction, Rounding rounding) noexcept override;
  Status place(Core& core, const Frame& frame, StopSignal stop, const StepResult& result,
               const AcceptStep& accept) override;
  void options_changed(Core& core) override;
  void poses_set(Core& core) noexcept override { thickness_changed(core); }
  void thickness_changed(Core& core) noexcept override;
  void patches_changed(Core& core) noexcept override;
  HeldOrder hierarchy_of(const Core& core, PartId part) const override {
    return trees_.hierarchy_of(core, part);
  }
  void parts_replaced(Core& core, std::span<PartChange> changes) noexcept override;
  void parts_changed() override;
  BoundsKind bounds() const override {
    return std::is_same_v<Bounds, Aabb> ? BoundsKind::kAabb : BoundsKind::kKDop18;
  }
  Status self_check(const Core& core, StopSignal stop) override;
  void forget(Core& core) override;
  std::size_t memory_bytes() const override;

 private:
  struct Attempt;

  void forget_steps(Core& core, Rebuild why) noexcept;
  // After a motion that nothing looked at was taken. What it moved is elsewhere: nothing that is known of it
  // holds. All else is where it was, but what moved in the last question has bounds of that motion, and the
  // states of its vertices, which would say so, were taken by this one.
  void forget_placed(Core& core) noexcept;
  // Budgets that were granted at the end of a trial are charged for what begins elsewhere.
  void leave_trial(const Core& core, TrialLeft left) noexcept;

  // A question, after it was checked: its motion begins, then run_stages() or run_shorter().
  NarrowPhaseOutput run(Core& core, SceneMotion::Step& motion, const Frame& frame, StopSignal stop,
                        StepStatistics& statistics);
  // The stages of a question, in order.
  NarrowPhaseOutput run_stages(Core& core, StopSignal stop, StepStatistics& statistics, StepTimer& timer);
  // The stages of a trial that goes part of the way of the longest one: of that one the hierarchies, the
  // front and all that is known of parts stay.
  NarrowPhaseOutput run_shorter(Core& core, StopSignal stop, StepStatistics& statistics, StepTimer& timer);
  void begin_question(Core& core, StopSignal stop);
  // Parts without a hierarchy get one, and those whose has decayed another. Returns whether the step counts
  // as one that rebuilds: all are new, or some decayed.
  bool arrange(const Core& core, StopSignal stop);
  // All pairs of parts that are near each other, a block at a time, each from the root: the same answer
  // without a front. With the front go the lists of neighbours, of which some have been tested: so all are,
  // again.
  FrontState traverse_in_blocks(Core& core, RefitStage<Bounds>& refit, const NarrowPhaseInput& input,
                                std::uint64_t& bv_tests);
  void remember_trial(const Core& core, StopSignal stop);
  // The last stages: half-spaces, the orphan sets, and collecting what was found. `roots`: by part, what
  // holds it; none where that is not known.
  NarrowPhaseOutput answer(Core& core, std::span<const Bounds> roots, StopSignal stop, StepTimer& timer);
  void take_world_tois(Core& core);
  // What leaves out pairs by their distance goes by it from here on.
  void take_widest_separation(Core& core, StopSignal stop);
  void begin_vertex_distances(Core& core, StopSignal stop);
  // Which parts are near each other, and how far the front is opened, goes by the widest of the last
  // questions: what one of these needs is not dropped because the others do not.
  void take_width(const Core& core);
  // Budgets hold what rounding could hide at the largest magnitude since they were granted. When that is
  // gone, bounds, budgets and travel begin again, as tight as the scene now allows.
  void forget_outliers(Core& core);
  NarrowPhaseInput narrow_input(Core& core, StopSignal stop, bool note_met) const;
  FrontInput front_input(const Core& core, StopSignal stop) const {
    return {core.options, budgets_.gap_at(), part_widths_, fold_widths_, widths_.wider(), stop};
  }
  static PartWidths part_widths(const Core& core, double separation) {
    return {separation, core.thickness, core.arcs, core.motion.vertices().frame()};
  }
  void count_front(StepCounts& counts) const;
  void count_parts(const Core& core, StepCounts& counts) const;
  // Is the motion in hand only asked about?
  bool is_question() const { return kind_ != Kind::kStep; }

  // Of the question in hand.
  Kind kind_ = Kind::kStep;
  PartWidths part_widths_;
  PartWidths fold_widths_;
  bool arranged_ = false;             // its hierarchies are there
  std::vector<std::uint8_t> placed_;  // by part, of place(): was it moved?
  bool unseen_places_ = false;        // since the last question

  // What stays from question to question, stage by stage.
  PartTrees<Bounds> trees_;
  NearStage<Bounds> near_;
  FrontStage<Bounds> front_;
  NarrowPhase<Bounds> narrow_;
  OrphanStage orphans_;
  HalfSpaceStage half_spaces_;
  TurningStage turning_;
  ReducedRows reduced_rows_;
  LongestTrial longest_;
  AskedWidths widths_;
  GrantedBudgets budgets_;
  StepLoad load_;
  std::uint64_t self_checks_ = 0;
};

}  // namespace warmfront

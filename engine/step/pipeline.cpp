// SPDX-License-Identifier: Apache-2.0
#include "engine/step/pipeline.h"

#include <algorithm>
#include <functional>
#include <limits>
#include <memory>
#include <string>
#include <type_traits>
#include <utility>

#include "engine/check/self_check.h"
#include "engine/narrow_phase/narrow_phase.h"
#include "engine/parallel/stoppable_loops.h"
#include "engine/state/part_trees.h"
#include "engine/step/asked_widths.h"
#include "engine/step/bodies_within.h"
#include "engine/step/contact_fields.h"
#include "engine/step/front_stage.h"
#include "engine/step/half_space_stage.h"
#include "engine/step/longest_trial.h"
#include "engine/step/near_stage.h"
#include "engine/step/orphan_stage.h"
#include "engine/step/patch_stage.h"
#include "engine/step/reduced_rows.h"
#include "engine/step/refit_stage.h"
#include "engine/step/step_timer.h"
#include "engine/step/turning_stage.h"
#include "engine/step/widest_separation.h"

namespace warmfront {
namespace {

Error too_many_contacts(const ColliderOptions& options) {
  const bool of_motion = options.pair_test == PairTest::kMotion;
  return {ErrorCode::kResourceExhausted,
          std::string("max_contacts: ") + (of_motion ? "the step has" : "there are") + " more than " +
              std::to_string(options.max_contacts) + (of_motion ? " contacts" : " pairs") +
              "; raise the limit, or ask for report \"count\"" + (of_motion ? " or \"earliest\"" : "")};
}

template <class Bounds>
class PipelineWith final : public Pipeline {
 public:
  Result<StepResult> step(Core& core, const Frame& frame, Kind kind, StopSignal stop,
                          const AcceptStep& accept) override {
    StepResult result;
    kind_ = kind;
    Attempt attempt(*this, core);
    NarrowPhaseOutput output;
    try {
      const auto whole = [&] { output = run(core, attempt.motion, frame, stop, result.statistics); };
      core.workers->run(std::cref(whole));  // which a std::function holds without memory of its own
    } catch (const Stopped&) {
      attempt.hierarchies_hold = arranged_;
      return Error{ErrorCode::kCancelled, "the step was cancelled; the frame may be sent again"};
    } catch (const TooManyContacts&) {
      attempt.hierarchies_hold = arranged_;
      return too_many_contacts(core.options);
    }
    attempt.hierarchies_hold = true;
    if (output.over_limit) return too_many_contacts(core.options);
    static_cast<KindCounts&>(result) = output.found;
    result.possible = output.possible;
    result.overlaps_at_start = output.overlaps;
    if (output.found.total() > 0 && core.options.pair_test == PairTest::kMotion)
      result.earliest_toi = output.earliest;
    const FoundPairs& found = core.found();
    result.contacts = found.contacts;
    result.geometry = found.geometry;
    result.closest_pairs = found.closest_pairs;
    if (core.options.report == Report::kEarliest) {
      result.worlds = core.worlds.numbers();
      result.world_tois = found.world_tois;
    }
    if (core.options.report == Report::kVertexDistances) result.vertex_distances = found.vertex_distances;
    if (accept)
      if (const Status accepted = accept(result); !accepted) return accepted.error();
    attempt.done(kind);
    if (kind == Kind::kStep) widths_.step_taken();
    if (!result.statistics.part_of_trial) {
      front_.done();
      longest_.looked_until(core.options.report == Report::kEarliest ? result.earliest_toi.value_or(1) : 1);
    }
    return result;
  }

  void commit(Core& core, double fraction, Rounding rounding) noexcept override {
    core.motion.commit_trial(fraction, rounding == Rounding::kFloat32, core.arcs);
    const bool beside = longest_.shortened();
    const double of_longest = beside ? fraction * longest_.fraction() : fraction;
    const bool whole = of_longest == 1 && !beside;
    const bool granted_at_end = granted_at_end_;
    if (!whole) leave_trial(core, TrialLeft::kForPartWay);
    granted_at_end_ = false;
    longest_.forget();
    if (!whole) trees_.shorten(core, of_longest, beside);
    if (of_longest == 0) {
      if (granted_at_end) front_.front().settle(trees_.trees(), part_widths(core, widths_.at_base()));
    } else if (whole && granted_at_end && widths_.last_is_widest()) {
      widths_.step_taken();  // what does not last was tested
    } else {
      front_.front().settle(trees_.trees(), part_widths(core, widths_.commit()));
    }
    if (fraction == 1 && !beside) return;
    core.rigid_parts.lose_track();
    near_.forget();  // rounding may put parts where no motion that was looked at goes
  }

  Status place(Core& core, const Frame& frame, StopSignal stop, const StepResult& result,
               const AcceptStep& accept) override {
    // What is kept counts from motions that do not lead here, also where this fails half-way.
    struct Forgetting {
      ~Forgetting() {
        if (done) return;
        core.rigid_parts.undo();
        pipeline.forget_steps(core, Rebuild::kForgotten);
      }
      PipelineWith& pipeline;
      Core& core;
      bool done = false;
    } forgetting{*this, core};
    SceneMotion::Step motion(core.motion);
    const auto begin = [&] { motion.begin(frame, stop); };
    core.workers->run(std::cref(begin));
    lengthen(placed_, core.motion.part_count(), std::uint8_t{0}, stop);
    trees_.make_room_to_forget();
    if (accept)
      if (Status accepted = accept(result); !accepted) return accepted;
    motion.commit();
    // Where bounds are of no motion that began here, nothing can be told of any part.
    forgetting.done = !longest_.shortened();
    if (forgetting.done) forget_placed(core);
    return {};
  }

  void options_changed(Core& core) override {
    front_.forget_answers();
    near_.forget();
    core.rigid_parts.undo();
    OrphanStage::forget_answers(core);
  }

  void poses_set(Core& core) noexcept override { thickness_changed(core); }

  void thickness_changed(Core& core) noexcept override {
    forget_steps(core, Rebuild::kForgotten);
    core.rigid_parts.undo();
  }

  void patches_changed(Core& core) noexcept override {
    forget_steps(core, Rebuild::kForgotten);
    trees_.clear();
  }

  HeldOrder hierarchy_of(const Core& core, PartId part) const override {
    return trees_.hierarchy_of(core, part);
  }

  void parts_replaced(Core& core, std::span<const PartChange> changes) noexcept override {
    for (std::uint32_t p = 0; p < changes.size(); ++p) {
      if (changes[p].is_new) {
        trees_.forget(PartId{p}, changes[p].keeps_hierarchy);
        front_.front().forget(PartId{p});
      } else {
        trees_.shift(PartId{p}, changes[p].shift);
      }
    }
    parts_changed();
    front_.forget_answers();  // which hold numbers
    OrphanStage::forget_answers(core);
  }

  void parts_changed() override {
    orphans_.forget_edge_faces();
    longest_.forget();
    near_.forget();
  }
  BoundsKind bounds() const override {
    return std::is_same_v<Bounds, Aabb> ? BoundsKind::kAabb : BoundsKind::kKDop18;
  }

  Status self_check(const Core& core, StopSignal stop) override {
    if (near_.stale() || unseen_places_ || longest_.shortened() || trees_.trees().empty()) return {};
    const bool front = core.options.front != FrontMode::kNone && !front_.lost();
    Status status;
    core.workers->run([&] {
      status = warmfront::self_check<Bounds>({core, trees_.trees(), trees_.roots(), trees_.refit_in(),
                                              trees_.step(), turning_.others(near_.pairs()), turning_.pairs(),
                                              near_.apart_pairs(), front ? &front_.front() : nullptr,
                                              trees_.magnitude(), part_widths_, self_checks_++, stop});
    });
    return status;
  }

  void forget(Core& core) override {
    RigidParts unmeasured;
    unmeasured.make_room(core.model);
    core.rigid_parts = std::move(unmeasured);
    forget_steps(core, Rebuild::kForgotten);
    trees_.clear();
  }

  std::size_t memory_bytes() const override {
    return sizeof(*this) + trees_.memory_bytes() + front_.front().memory_bytes() + narrow_.memory_bytes() +
           near_.memory_bytes() + orphans_.memory_bytes() + placed_.capacity() + half_spaces_.memory_bytes() +
           turning_.memory_bytes() + reduced_rows_.memory_bytes() + longest_.memory_bytes();
  }

 private:
  /// A step that may fail, at whatever instruction: unless it is committed, the scene is left where it was,
  /// and nothing is kept that counts from positions that were never taken.
  struct Attempt {
    Attempt(PipelineWith& the_pipeline, Core& the_core)
        : motion(the_core.motion), pipeline(the_pipeline), core(the_core) {}
    ~Attempt() {
      if (committed) return;
      if (pipeline.kind_ == Kind::kAgain) motion.keep();  // the trial, which stands
      // Memory that grew with the step is given back, too.
      pipeline.narrow_.release();
      pipeline.near_.release();
      pipeline.half_spaces_ = {};
      pipeline.turning_ = {};
      pipeline.reduced_rows_ = {};
      core.found() = {};
      core.rigid_parts.undo();
      pipeline.forget_steps(core, Rebuild::kInterrupted);
      if (!hierarchies_hold) pipeline.trees_.clear();  // what was half done is not built upon
    }
    Attempt(const Attempt&) = delete;
    Attempt& operator=(const Attempt&) = delete;

    void done(Kind kind) noexcept {
      kind == Kind::kStep ? motion.commit() : motion.keep();
      committed = true;
    }

    SceneMotion::Step motion;
    PipelineWith& pipeline;
    Core& core;
    bool hierarchies_hold = false;
    bool committed = false;
  };

  void forget_steps(Core& core, Rebuild why) noexcept {
    longest_.forget();
    front_.lose(why);
    near_.forget();
    trees_.forget_bounds();
    OrphanStage::forget_answers(core);
  }

  // After a motion that nothing looked at was taken. What it moved is elsewhere: nothing that is known of it
  // holds. All else is where it was, but what moved in the last question has bounds of that motion, and the
  // states of its vertices, which would say so, were taken by this one.
  void forget_placed(Core& core) noexcept {
    if (core.motion.from() == From::kStart) {
      leave_trial(core, TrialLeft::kForBase);
      trees_.return_to_base();
    }
    trees_.forget_bounds_of_moved();
    for (std::uint32_t p = 0; p < core.motion.part_count(); ++p) {
      const MotionState state = core.motion.state(PartId{p});
      placed_[p] = (state & kMoving) != 0 ? 1 : 0;
      if (state != 0) trees_.forget_bounds(PartId{p});
    }
    front_.front().forget(placed_);
    OrphanStage::forget_answers(core);
    core.rigid_parts.lose_track(placed_);
    longest_.forget();
    unseen_places_ = true;
  }

  NarrowPhaseOutput run(Core& core, SceneMotion::Step& motion, const Frame& frame, StopSignal stop,
                        StepStatistics& statistics) {
    StepTimer timer(statistics.ms);
    statistics.bounds = bounds();
    arranged_ = false;
    kind_ == Kind::kAgain ? motion.begin_again() : motion.begin(frame, stop);
    core.arcs.take(core.model.screws(), core.topology->scene.body_of_vertex(), core.motion, stop);
    if (core.keep.share > 0) take_widest_separation(core, stop);
    take_width(core);
    begin_vertex_distances(core, stop);
    const bool shorter = is_question() && longest_.contains_motion(core, trees_.magnitude(), stop);
    return shorter ? run_shorter(core, stop, statistics, timer) : run_stages(core, stop, statistics, timer);
  }

  // What leaves out pairs by their distance goes by it from here on.
  void take_widest_separation(Core& core, StopSignal stop) {
    const double widest = widest_separation(core, stop);
    if (widest != core.asked_separation) options_changed(core);
    core.options.min_separation = core.asked_separation = widest;
  }

  void begin_vertex_distances(Core& core, StopSignal stop) {
    if (core.options.report != Report::kVertexDistances) return;
    std::vector<double>& distances = core.found().vertex_distances;
    distances.clear();
    lengthen(distances, core.scene->vertex_count(), core.options.min_separation, stop);
  }

  // Which parts are near each other, and how far the front is opened, goes by the widest of the last
  // questions: what one of these needs is not dropped because the others do not.
  void take_width(const Core& core) {
    const double held = widths_.held();
    widths_.begin(core.options.min_separation);
    part_widths_ = part_widths(core, core.options.min_separation);
    fold_widths_ = part_widths(core, widths_.held());
    if (widths_.held() == held) return;
    trees_.hold(widths_.held());
    near_.forget();
  }

  static PartWidths part_widths(const Core& core, double separation) {
    return {separation, core.thickness, core.arcs, core.motion.vertices().frame()};
  }

  FrontInput front_input(const Core& core, StopSignal stop) const {
    return {core.options, gap_at_, part_widths_, fold_widths_, widths_.wider(), stop};
  }

  // The stages of a question, in order.
  NarrowPhaseOutput run_stages(Core& core, StopSignal stop, StepStatistics& statistics, StepTimer& timer) {
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

  // The stages of a trial that goes part of the way of the longest one: of that one the hierarchies, the
  // front and all that is known of parts stay.
  NarrowPhaseOutput run_shorter(Core& core, StopSignal stop, StepStatistics& statistics, StepTimer& timer) {
    StepCounts& counts = statistics.counts;
    arranged_ = true;
    statistics.part_of_trial = true;
    statistics.front_state =
        core.options.front == FrontMode::kNone ? FrontState::kNone : FrontState::kUpdated;
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
    count_parts(core, counts);
    return output;
  }

  // The last stages: half-spaces, the orphan sets, and collecting what was found. `roots`: by part, what
  // holds it; none where that is not known.
  NarrowPhaseOutput answer(Core& core, std::span<const Bounds> roots, StopSignal stop, StepTimer& timer) {
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

  void take_world_tois(Core& core) {
    std::vector<double>& tois = core.found().world_tois;
    tois.clear();
    if (core.options.report != Report::kEarliest) return;
    for (std::uint32_t world = 0; world < core.worlds.numbers().size(); ++world) {
      const double toi = narrow_.earliest_in(world);
      tois.push_back(toi <= 1 ? toi : std::numeric_limits<double>::infinity());
    }
  }

  // Budgets that were granted at the end of a trial are charged for what begins elsewhere.
  void leave_trial(const Core& core, TrialLeft left) noexcept {
    if (!std::exchange(granted_at_end_, false)) return;
    front_.front().leave_trial(trees_.trees(), trees_.off_base(), left, part_widths(core, widths_.at_base()));
  }

  void begin_question(Core& core, StopSignal stop) {
    if (core.motion.from() == From::kStart) leave_trial(core, TrialLeft::kForBase);
    choose_gap(core);
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

  void remember_trial(const Core& core, StopSignal stop) {
    if (!narrow_.knows_met()) return;
    const bool left_out = core.rigid_parts.count() > 0 || !near_.apart_pairs().empty();
    // Of pairs that rest only the answers are kept, not which pairs met: another question may ask about
    // these.
    const bool kept = narrow_.met_kept() || front_.front().counts().rested > 0;
    longest_.remember(core, {.left_out = left_out, .kept = kept}, stop);
  }

  NarrowPhaseInput narrow_input(Core& core, StopSignal stop, bool note_met) const {
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
            gap_at_,
            note_met,
            core.keep,
            part_widths_,
            core.found().vertex_distances,
            !core.model.half_spaces().empty()};
  }

  // Budgets hold what rounding could hide at the largest magnitude since they were granted. When that is
  // gone, bounds, budgets and travel begin again, as tight as the scene now allows.
  void forget_outliers(Core& core) {
    if (!(core.motion.vertices().magnitude() < trees_.magnitude())) return;
    forget_steps(core, Rebuild::kDecayed);
    trees_.clear();
  }

  // Parts without a hierarchy get one, and those whose has decayed another. Returns whether the step counts
  // as one that rebuilds: all are new, or some decayed.
  bool arrange(const Core& core, StopSignal stop) {
    const std::size_t arranged = trees_.arrange_new(core, near_.stale(), stop);
    if (arranged > 0) near_.forget();
    const std::span<const PartId> rearranged = trees_.rearrange_loose(core, stop);
    for (const PartId part : rearranged) front_.front().forget(part);
    if (trees_.take_magnitude(core.motion.vertices().magnitude())) near_.forget();
    arranged_ = true;
    return (arranged > 0 && arranged == trees_.trees().size()) || !rearranged.empty();
  }

  // All pairs of parts that are near each other, a block at a time, each from the root: the same answer
  // without a front. With the front go the lists of neighbours, of which some have been tested: so all are,
  // again.
  FrontState traverse_in_blocks(Core& core, RefitStage<Bounds>& refit, const NarrowPhaseInput& input,
                                std::uint64_t& bv_tests) {
    const FrontState state = front_.begin_without(core.options);
    narrow_.begin(trees_.trees(), input);
    while (near_.next_block(core, trees_, bv_tests, input.stop)) {
      refit.refit_near(near_.pairs());
      bv_tests += front_.traverse(trees_.trees(), near_.pairs(), narrow_, front_input(core, input.stop));
    }
    return state;
  }

  // Is the motion in hand only asked about?
  bool is_question() const { return kind_ != Kind::kStep; }

  // Budgets are granted where the next motion begins, most likely: at the end of a trial that will be taken,
  // at the base of several of which none is part of another's way. Whoever asked for several from the last
  // base may do so from this one.
  void choose_gap(const Core& core) {
    if (core.motion.from() == From::kEnd) {
      several_before_ = std::exchange(several_, false);
      left_base_ = false;
    }
    several_ |= left_base_;
    gap_at_ = kind_ == Kind::kStep || !(several_before_ || several_) ? GapAt::kEnd : GapAt::kStart;
    granted_at_end_ = is_question() && gap_at_ == GapAt::kEnd;
    for (std::uint32_t p = 0; p < core.motion.part_count() && !left_base_; ++p)
      left_base_ = (core.motion.state(PartId{p}) & kMoving) != 0;
  }

  void count_front(StepCounts& counts) const {
    const FrontCounts& front = front_.front().counts();
    counts.front_skipped = front.skipped;
    counts.front_rested = front.rested;
    counts.front_sprouted = front.sprouted;
    counts.front_pruned = front.pruned;
    counts.nodes_refit = trees_.refit_nodes();
  }

  void count_parts(const Core& core, StepCounts& counts) const {
    counts.adjacent_pairs = core.topology->adjacent_pairs;
    counts.front_pairs = front_.front().size();
    counts.front_bytes = front_.front().pair_bytes();
    counts.vertices_moved = core.motion.moved_vertices();
    counts.parts_moved = static_cast<std::uint64_t>(
        std::ranges::count_if(trees_.states(), [](MotionState state) { return (state & kMoving) != 0; }));
    counts.parts = core.model.part_count();
    counts.parts_rigid = core.rigid_parts.count();
    counts.near_parts = near_.count();
    counts.parts_apart = near_.apart_pairs().size();
    counts.part_pairs_excluded = core.excluded_pairs;
  }

  // Of the question in hand.
  Kind kind_ = Kind::kStep;
  PartWidths part_widths_;
  PartWidths fold_widths_;
  bool arranged_ = false;             // its hierarchies are there
  std::vector<std::uint8_t> placed_;  // by part, of place(): was it moved?
  GapAt gap_at_ = GapAt::kEnd;        // where budgets are granted
  bool granted_at_end_ = false;       // they were so, at the end of a trial that still counts
  // Of the questions since motions begin where they do: had one of them a motion, or several? And of those
  // before?
  bool left_base_ = false;
  bool several_ = false;
  bool several_before_ = false;
  bool unseen_places_ = false;  // since the last question

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
  std::uint64_t self_checks_ = 0;
};

}  // namespace

std::unique_ptr<Pipeline> make_pipeline(BoundsKind bounds) {
  if (bounds == BoundsKind::kAabb) return std::make_unique<PipelineWith<Aabb>>();
  return std::make_unique<PipelineWith<KDop18>>();
}

}  // namespace warmfront

// SPDX-License-Identifier: Apache-2.0
// What is asked of a pipeline, and what stands after it. The stages are in pipeline_stages.cpp.
#include "engine/step/pipeline.h"

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "engine/check/self_check.h"
#include "engine/parallel/stoppable_loops.h"
#include "engine/step/pipeline_with.h"

namespace warmfront {
namespace {

Error too_many_contacts(const ColliderOptions& options) {
  const bool of_motion = options.pair_test == PairTest::kMotion;
  const char* const otherwise = !of_motion ? "ask for report \"count\""
                                : options.report == Report::kEarliest
                                    ? "ask a trial for report \"count\""
                                    : "ask for report \"count\" or \"earliest\"";
  return {ErrorCode::kResourceExhausted,
          std::string("max_contacts: ") + (of_motion ? "the step has" : "there are") + " more than " +
              std::to_string(options.max_contacts) + (of_motion ? " contacts" : " pairs") +
              "; raise the limit, or " + otherwise};
}

}  // namespace

/// A step that may fail, at whatever instruction: unless it is committed, the scene is left where it was,
/// and nothing is kept that counts from positions that were never taken.
template <class Bounds>
struct PipelineWith<Bounds>::Attempt {
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

template <class Bounds>
Result<StepResult> PipelineWith<Bounds>::step(Core& core, const Frame& frame, Kind kind, StopSignal stop,
                                              const AcceptStep& accept) {
  StepResult result;
  kind_ = kind;
  std::optional<Workers::OneThread> one_thread;
  if (core.workers->adapts_to_steps() && load_.is_small(core.options, core.topology->scene.element_count()))
    one_thread.emplace();
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
    load_.took(core.options, result.statistics.counts);
    front_.done();
    longest_.looked_until(core.options.report == Report::kEarliest ? result.earliest_toi.value_or(1) : 1);
  }
  return result;
}

template <class Bounds>
void PipelineWith<Bounds>::commit(Core& core, double fraction, Rounding rounding) noexcept {
  const bool beside = longest_.shortened();
  const double of_longest = beside ? fraction * longest_.fraction() : fraction;
  const bool whole = of_longest == 1 && !beside;
  const bool granted_at_end = budgets_.at_trial_end();
  if (!whole) leave_trial(core, fraction == 0 ? TrialLeft::kForBase : TrialLeft::kForPartWay);
  budgets_.leave_trial_end();
  longest_.forget();
  if (fraction == 0)
    trees_.go_back();
  else if (!whole)
    trees_.shorten(core, of_longest, beside, rounding);
  if (fraction != 0 && (fraction != 1 || beside)) core.rigid_parts.lose_rounded(core.motion);
  core.motion.commit_trial(fraction, rounding == Rounding::kFloat32, core.arcs);
  if (fraction == 0) {
    // What was granted there holds, and so does what was granted at the base.
  } else if (whole && granted_at_end && widths_.last_is_widest()) {
    widths_.step_taken();  // what does not last was tested
  } else {
    front_.front().settle(trees_.trees(), part_widths(core, widths_.commit()));
  }
  if (fraction == 1 && !beside) return;
  core.rigid_parts.lose_track();
  near_.forget();  // rounding may put parts where no motion that was looked at goes
}

template <class Bounds>
Status PipelineWith<Bounds>::place(Core& core, const Frame& frame, StopSignal stop, const StepResult& result,
                                   const AcceptStep& accept) {
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
  load_.forget();
  // Where bounds are of no motion that began here, nothing can be told of any part.
  forgetting.done = !longest_.shortened();
  if (forgetting.done) forget_placed(core);
  return {};
}

template <class Bounds>
void PipelineWith<Bounds>::options_changed(Core& core) {
  load_.forget();
  front_.forget_answers();
  near_.forget();
  core.rigid_parts.undo();
  OrphanStage::forget_answers(core);
}

template <class Bounds>
void PipelineWith<Bounds>::thickness_changed(Core& core) noexcept {
  forget_steps(core, Rebuild::kForgotten);
  core.rigid_parts.undo();
}

template <class Bounds>
void PipelineWith<Bounds>::patches_changed(Core& core) noexcept {
  forget_steps(core, Rebuild::kForgotten);
  trees_.clear();
}

template <class Bounds>
void PipelineWith<Bounds>::parts_replaced(Core& core, std::span<PartChange> changes) noexcept {
  for (std::uint32_t p = 0; p < changes.size(); ++p) {
    if (!changes[p].changed_blocks.empty() &&
        trees_.change(PartId{p}, std::move(changes[p].changed_blocks))) {
      continue;  // and the front with it, in the next step
    } else if (changes[p].is_new) {
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

template <class Bounds>
void PipelineWith<Bounds>::parts_changed() {
  load_.forget();
  orphans_.forget_edge_faces();
  longest_.forget();
  near_.forget();
}

template <class Bounds>
Status PipelineWith<Bounds>::self_check(const Core& core, StopSignal stop) {
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

template <class Bounds>
void PipelineWith<Bounds>::forget(Core& core) {
  RigidParts unmeasured;
  unmeasured.make_room(core.model);
  core.rigid_parts = std::move(unmeasured);
  forget_steps(core, Rebuild::kForgotten);
  trees_.clear();
}

template <class Bounds>
std::size_t PipelineWith<Bounds>::memory_bytes() const {
  return sizeof(*this) + trees_.memory_bytes() + front_.front().memory_bytes() + narrow_.memory_bytes() +
         near_.memory_bytes() + orphans_.memory_bytes() + placed_.capacity() + half_spaces_.memory_bytes() +
         turning_.memory_bytes() + reduced_rows_.memory_bytes() + longest_.memory_bytes();
}

template <class Bounds>
void PipelineWith<Bounds>::forget_steps(Core& core, Rebuild why) noexcept {
  load_.forget();
  longest_.forget();
  front_.lose(why);
  near_.forget();
  trees_.forget_bounds();
  OrphanStage::forget_answers(core);
}

template <class Bounds>
void PipelineWith<Bounds>::forget_placed(Core& core) noexcept {
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

template <class Bounds>
void PipelineWith<Bounds>::leave_trial(const Core& core, TrialLeft left) noexcept {
  if (!budgets_.leave_trial_end()) return;
  front_.front().leave_trial(trees_.trees(), trees_.off_base(), left, part_widths(core, widths_.at_base()));
}

template class PipelineWith<Aabb>;
template class PipelineWith<KDop18>;

std::unique_ptr<Pipeline> make_pipeline(BoundsKind bounds) {
  if (bounds == BoundsKind::kAabb) return std::make_unique<PipelineWith<Aabb>>();
  return std::make_unique<PipelineWith<KDop18>>();
}

}  // namespace warmfront

// SPDX-License-Identifier: Apache-2.0
// A collider's questions, steps and commits; its changes are in collider_changes.cpp.
#include "engine/collider.h"

#include <algorithm>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "engine/digits.h"
#include "engine/motion/check_positions.h"
#include "engine/step/collider_impl.h"

namespace warmfront {
namespace {

constexpr std::string_view kNoTrial =
    "no trial was answered since the last step, commit, change of the scene or its options, or request that "
    "failed; ask for a trial or max_step first";

Status check_frame(Core& core, const Frame& frame, StopSignal stop, PoseCheck poses = PoseCheck::kRigid) {
  return core.motion.check(*core.scene, frame, stop, poses, core.workers.get());
}

// Where a frame's check forks, it enters the arena together with what is asked.
template <class Ask>
Result<StepResult> entering_once(const Core& core, const Frame& frame, const Ask& ask) {
  if (!frame.positions || !check_forks(*frame.positions)) return ask();
  std::optional<Result<StepResult>> result;
  const auto whole = [&] { result = ask(); };
  core.workers->enter_once(std::cref(whole));
  return *std::move(result);
}

}  // namespace

Collider::Collider(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Collider::~Collider() = default;
Collider::Collider(Collider&&) noexcept = default;
Collider& Collider::operator=(Collider&&) noexcept = default;

Result<Collider> Collider::create(std::shared_ptr<const Scene> scene, const Positions& positions,
                                  const ColliderOptions& options, std::shared_ptr<Workers> workers,
                                  const std::atomic<bool>* cancelled) try {
  if (options.keep_distance) return keep_distance_is_of_max_step();
  Result<WarmScene> made =
      WarmScene::create(std::move(scene), positions, options, std::move(workers), StopSignal(cancelled));
  if (!made) return made.error();
  Collider collider(std::make_unique<Impl>(Impl{std::move(made).value()}));
  if (options.explain)
    collider.impl_->all_deformable = std::make_unique<AllDeformable>(collider.impl_->warm.core.workers);
  return collider;
} catch (const Stopped&) {
  return was_cancelled();
}

Result<StepResult> Collider::step(const Frame& frame, const std::atomic<bool>* cancelled,
                                  const AcceptStep& accept, const QuestionOptions& options) try {
  Core& core = impl_->warm.core;
  Impl::Asking asking(*impl_);
  const StopSignal stop(cancelled);
  if (Status status = validate(QuestionKind::kStep, options); !status) return status.error();
  Result<StepResult> result = entering_once(core, frame, [&]() -> Result<StepResult> {
    if (Status status = check_frame(core, frame, stop); !status) return status.error();
    if (impl_->all_deformable != nullptr) impl_->all_deformable->begin(core, stop);
    return impl_->warm.ask(frame, Kind::kStep, merged(core.options, options), stop, accept);
  });
  asking.answered = result.ok();
  if (result) {
    impl_->last_trial.reset();
    impl_->known_state.reset();
  }
  if (result && impl_->all_deformable != nullptr)
    result.value().all_deformable = impl_->all_deformable->follow(core, stop);
  return result;
} catch (const Stopped&) {
  return was_cancelled();
}

Result<StepResult> Collider::Impl::trial(const Frame& frame, const Question& question, StopSignal stop,
                                         const AcceptStep& accept) {
  const Core& core = warm.core;
  const ColliderOptions options = merged(core.options, question);
  Asking asking(*this);
  if (Status status = validate(question.kind, question.options); !status) return status.error();
  Result<StepResult> result = entering_once(core, frame, [&]() -> Result<StepResult> {
    if (Status status = check_frame(warm.core, frame, stop); !status) return status.error();
    return warm.ask(frame, Kind::kTrial, options, stop, accept);
  });
  asking.answered = result.ok();
  if (!result) return result;
  last_trial = {options.report, result.value(), result.value().possible, result.value().earliest_toi};
  if (known_state && known_state->asked.instant == Instant::kEnd) known_state.reset();
  return result;
}

Result<StepResult> Collider::Impl::ask_of_state(const ColliderOptions& options, StopSignal stop,
                                                const AcceptStep& accept) {
  if (Status status = validate(options); !status) return status.error();
  if (options.instant == Instant::kEnd && !last_trial)
    return Error{ErrorCode::kFailedPrecondition, "where: " + std::string(kNoTrial)};
  if (known_state && known_state->asked == options) {
    StepResult known = known_state->answer;
    known.statistics = {};
    known.statistics.bounds = warm.pipeline->bounds();
    known.statistics.counts.contacts_kept = known.total();
    if (accept)
      if (const Status accepted = accept(known); !accepted) return accepted.error();
    return known;
  }
  known_state.reset();
  Result<StepResult> result =
      warm.ask(Frame(), last_trial ? Kind::kAgain : Kind::kTrial, options, stop, accept);
  if (result) known_state = {options, result.value()};
  return result;
}

Result<StepResult> Collider::proximity(double distance, Where where, const QuestionOptions& options,
                                       const std::atomic<bool>* cancelled, const AcceptStep& accept) {
  return ask(Frame(), Question::proximity(distance, where, options), cancelled, accept);
}

Result<StepResult> Collider::vertex_distances(double distance, Where where, const QuestionOptions& options,
                                              const std::atomic<bool>* cancelled, const AcceptStep& accept) {
  return ask(Frame(), Question::vertex_distances(distance, where, options), cancelled, accept);
}

Result<StepResult> Collider::trial(const Frame& frame, const QuestionOptions& options,
                                   const std::atomic<bool>* cancelled, const AcceptStep& accept) try {
  return impl_->trial(frame, {QuestionKind::kTrial, options}, StopSignal(cancelled), accept);
} catch (const Stopped&) {
  return was_cancelled();
}

Result<MaxStep> Collider::max_step(const Frame& frame, bool leave_out_overlaps,
                                   const QuestionOptions& options, const std::atomic<bool>* cancelled,
                                   Rounding rounding) try {
  const Question question{.kind = QuestionKind::kMaxStep,
                          .options = options,
                          .leave_out_overlaps = leave_out_overlaps,
                          .rounding = rounding};
  Result<StepResult> result = impl_->trial(frame, question, StopSignal(cancelled), {});
  if (!result) return result.error();
  const StepResult& answer = result.value();
  MaxStep step;
  step.fraction = answer.earliest_toi.value_or(1);
  // With worlds, the earliest of each are listed.
  const auto first = std::ranges::find(answer.contacts, step.fraction, &Contact::toi);
  if (answer.earliest_toi && first != answer.contacts.end()) step.first = *first;
  step.overlaps_at_start =
      answer.overlaps_at_start + static_cast<std::uint64_t>(std::ranges::count(
                                     answer.contacts, ContactStatus::kOverlapAtStart, &Contact::status));
  step.worlds.assign(answer.worlds.begin(), answer.worlds.end());
  step.world_fractions.reserve(answer.world_tois.size());
  for (const double toi : answer.world_tois) step.world_fractions.push_back(std::min(toi, 1.0));
  step.statistics = answer.statistics;
  return step;
} catch (const Stopped&) {
  return was_cancelled();
}

Result<StepResult> Collider::ask(const Frame& frame, const Question& question,
                                 const std::atomic<bool>* cancelled, const AcceptStep& accept) try {
  if (question.kind == QuestionKind::kStep) return step(frame, cancelled, accept, question.options);
  if (question.kind == QuestionKind::kPlace)
    return impl_->place(frame, question, StopSignal(cancelled), accept);
  if (!question.of_state()) return impl_->trial(frame, question, StopSignal(cancelled), accept);
  if (Status valid = validate(question.kind, question.options); !valid) return valid.error();
  if (!frame.empty())
    return invalid_argument(
        "positions: a question about a state moves nothing; leave the frame empty, or make it a trial and "
        "ask with where at the trial's end");
  return impl_->ask_of_state(merged(impl_->warm.core.options, question), StopSignal(cancelled), accept);
} catch (const Stopped&) {
  return was_cancelled();
}

Result<StepResult> Collider::intersections(Where where, const QuestionOptions& options,
                                           const std::atomic<bool>* cancelled, const AcceptStep& accept) {
  return ask(Frame(), Question::intersections(where, options), cancelled, accept);
}

Result<CommitResult> Collider::commit(double fraction, Rounding rounding) {
  Core& core = impl_->warm.core;
  if (!(fraction >= 0 && fraction <= 1))
    return invalid_argument("fraction: " + digits_of(fraction) + " is not in [0, 1]");
  if (!impl_->last_trial) return Error{ErrorCode::kFailedPrecondition, "commit: " + std::string(kNoTrial)};
  const Impl::Trial& trial = *impl_->last_trial;
  CommitResult result;
  result.fraction = fraction;
  if (trial.earliest_toi && *trial.earliest_toi <= fraction) result.earliest_toi = trial.earliest_toi;
  if (trial.report != Report::kCount) {
    KindCounts within;
    for (const Contact& c : core.met.contacts)
      if (c.toi <= fraction) within.count(c.kind);
    result.vf = within.vf;
    result.ee = within.ee;
    result.vh = within.vh;
    result.possible =
        static_cast<std::uint64_t>(std::ranges::count_if(core.met.contacts, [&](const Contact& c) {
          return c.toi <= fraction &&
                 (c.status == ContactStatus::kPossible || c.status == ContactStatus::kBudget);
        }));
  } else if (fraction == 1 || !result.earliest_toi) {
    result.vf = fraction == 1 ? trial.found.vf : 0;
    result.ee = fraction == 1 ? trial.found.ee : 0;
    result.vh = fraction == 1 ? trial.found.vh : 0;
    result.possible = fraction == 1 ? trial.possible : 0;
  }
  impl_->warm.pipeline->commit(core, fraction, rounding);
  impl_->last_trial.reset();
  impl_->known_state.reset();
  impl_->restart_comparison();
  return result;
}

Status Collider::place(const Frame& frame, const std::atomic<bool>* cancelled, const AcceptStep& accept) {
  const Result<StepResult> placed = ask(frame, {QuestionKind::kPlace}, cancelled, accept);
  return placed ? Status() : Status(placed.error());
}

Result<StepResult> Collider::Impl::place(const Frame& frame, const Question& question, StopSignal stop,
                                         const AcceptStep& accept) {
  Asking asking(*this);
  if (Status status = validate(question.kind, question.options); !status) return status.error();
  if (Status status = check_frame(warm.core, frame, stop, PoseCheck::kPartWay); !status)
    return status.error();
  StepResult result;
  result.statistics.bounds = warm.pipeline->bounds();
  if (Status placed = warm.pipeline->place(warm.core, frame, stop, result, accept); !placed)
    return placed.error();
  forget_answers();
  restart_comparison();
  return result;
}

Status Collider::place(std::span<const BodyPose> poses, const std::atomic<bool>* cancelled) try {
  impl_->forget_answers();
  Core& core = impl_->warm.core;
  Frame frame;
  frame.poses = poses;
  if (Status status = core.motion.check(*core.scene, frame, StopSignal(cancelled), PoseCheck::kPartWay);
      !status)
    return status;
  if (Status status = core.motion.set_poses(poses); !status) return status;
  impl_->warm.pipeline->poses_set(core);
  impl_->restart_comparison();
  return {};
} catch (const Stopped&) {
  return was_cancelled();
}

Status Collider::self_check(const std::atomic<bool>* cancelled) try {
  return impl_->warm.pipeline->self_check(impl_->warm.core, StopSignal(cancelled));
} catch (const Stopped&) {
  return was_cancelled();
}
void Collider::forget_warmth() {
  impl_->warm.pipeline->forget(impl_->warm.core);
}

const Scene& Collider::scene() const {
  return *impl_->warm.core.scene;
}
std::shared_ptr<const Scene> Collider::shared_scene() const {
  return impl_->warm.core.scene;
}
const ColliderOptions& Collider::options() const {
  return impl_->warm.core.options;
}
std::vector<double> Collider::positions() const {
  return impl_->warm.core.motion.positions();
}
std::vector<BodyPose> Collider::poses() const {
  return impl_->warm.core.motion.poses();
}

std::size_t Collider::memory_bytes() const {
  constexpr std::size_t kOfNoScene = 4 << 10;  // small objects, of which each collider has a few
  std::size_t bytes = sizeof(Impl) + kOfNoScene + impl_->warm.memory_bytes();
  if (impl_->all_deformable != nullptr) bytes += impl_->all_deformable->memory_bytes();
  return bytes;
}

}  // namespace warmfront

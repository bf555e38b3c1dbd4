// SPDX-License-Identifier: Apache-2.0
// A frame's way through a session: submitted, carried out in its turn, computed, answered. Thread safety as
// stated in session.h.
#include <algorithm>
#include <array>
#include <bit>
#include <cstdio>
#include <string>
#include <utility>

#include "server/session/scene_growth.h"
#include "server/session/session_turn.h"

namespace warmfront::server {

void Session::expect_step() const noexcept {
  if (workers_ && runner_.busy() == 0 && mailbox_->takes_a_short_step_here()) workers_->rouse();
}

void Session::submit(AdmittedFrame given, Admission admission) {
  if (const FrameQuestion* question = given.question()) given.pass.hold(question->contents.memory_bytes());
  // Shared, because a std::function must be copyable, and the frame is answered on whichever of two paths is
  // taken.
  const auto frame = std::make_shared<AdmittedFrame>(std::move(given));
  Mailbox::Job job = [in_hand = in_hand(), frame] { (*in_hand)->carry_out(*frame); };
  if (admission != Admission::kBounded) {
    mailbox_->run_or_post(std::move(job),
                          admission == Admission::kHere ? Mailbox::Here::kShort : Mailbox::Here::kBrief);
  } else if (!mailbox_->post(std::move(job), Mailbox::Kind::kStep)) {
    frame->observer->answered(limit_met(
        frame_name(frame->number) + ": too many frames of this session wait; send it again after an answer",
        "window", true));
  }
}

void Session::carry_out(AdmittedFrame& frame) noexcept {
  std::array<char, 32> name{};  // where no memory is needed
  static_cast<void>(
      std::snprintf(name.data(), name.size(), "frame %llu", static_cast<unsigned long long>(frame.number)));
  const auto outcome = guarded<std::shared_ptr<const Answer>>(name.data(), [&] {
    frame.observer->begins();
    return compute(frame);
  });
  // A motion that failed is followed by no commit of the one before it; a question about a state leaves that
  // as it is, as Collider does.
  if (!outcome && frame.moves()) history_.forget_trial();
  // The frame is computed: what it held is free before its client hears of it, or kept for the next.
  if (FrameQuestion* question = frame.question()) spare_.keep(question->contents.release());
  frame.pass.give_back();
  frame.observer->answered(outcome);
}

FrameOutcome Session::compute(AdmittedFrame& frame) {
  const std::uint64_t number = frame.number;
  if (frame.pass.cancelled()) return given_up(frame_name(number));
  if (frame.pass.refused) return *frame.pass.refused;
  if (frame.pass.attachment && *frame.pass.attachment < holder_) return taken_over();
  switch (history_.frames().classify(number)) {
    case FrameSequence::Verdict::kOutOfOrder:
      return out_of_order(number);
    case FrameSequence::Verdict::kRepeat:
      return frame.counts() ? history_.repeated(frame) : out_of_order(number);
    case FrameSequence::Verdict::kNext:
      break;
  }
  FrameQuestion* question = frame.question();
  return question != nullptr ? ask(frame, *question)
                             : take_trial(number, std::get<FrameCommit>(frame.content));
}

Fault Session::out_of_order(std::uint64_t frame) const {
  return {ErrorCode::kFailedPrecondition, Reason::kFrameOutOfOrder,
          frame_name(frame) + " is out of order: frame " + std::to_string(history_.frames().expected()) +
              " is expected",
          history_.frames().expected()};
}

Outcome<Question> Session::within_limits(Question question) const {
  question.rounding = rounding();
  const QuestionOptions& options = question.options;
  const auto invalid = [](std::string message) {
    return Fault{ErrorCode::kInvalidArgument, Reason::kInvalidInput, std::move(message)};
  };
  if (options.max_contacts && *options.max_contacts > collider_.options().max_contacts)
    return invalid("question.max_contacts: " + std::to_string(*options.max_contacts) +
                   " is above the session's " + std::to_string(collider_.options().max_contacts));
  const ColliderOptions asked = merged(collider_.options(), question);
  if (Status valid = validate(asked); !valid) return fault_from(valid.error(), "question.");
  // With more fields than the session's, or what reducing takes, fewer contacts have room.
  if (options.fields || options.reduced)
    question.options.max_contacts = std::min(
        asked.max_contacts,
        most_contacts(limits_.max_session_bytes, collider_.options().explain, asked.fields, options.reduced));
  return question;
}

Outcome<Question> Session::ready(AdmittedFrame& frame, FrameQuestion& asked) const {
  const std::string where = frame_name(frame.number) + ": ";
  Outcome<Question> question = within_limits(asked.question);
  if (!question) {
    Fault fault = question.fault();
    fault.message = where + fault.message;
    return fault;
  }
  // The collider may have an older one, where a later one failed before it came there.
  if (asked.question.where == Where::kTrialEnd && !history_.trial())
    return Fault{
        ErrorCode::kFailedPrecondition, Reason::kInvalidInput,
        where +
            "question.where: no trial of this frame was answered since the last frame or change of the "
            "scene or its options, or a motion failed since; send the trial again"};
  if (Status complete = asked.contents.complete(collider_.scene()); !complete)
    return fault_from(complete.error(), where);
  frame.pass.hold(asked.contents.memory_bytes());
  if (std::optional<Fault> refusal = account_->refusal()) {
    refusal->message = where + refusal->message;
    return with_removed(*std::move(refusal), collider_.scene());
  }
  return question;
}

FrameOutcome Session::ask(AdmittedFrame& frame, FrameQuestion& asked) {
  const Outcome<Question> question = ready(frame, asked);
  if (!question) return question.fault();
  if (check_is_due()) {
    const Running running(*this, frame.pass.given_up.get());
    if (Outcome<std::string> checked = self_check(frame_name(frame.number) + ": ", running.stop()); !checked)
      return checked.fault();
  }
  const std::chrono::duration<double> waited = std::chrono::steady_clock::now() - frame.arrived;
  StateDigest digest(history_.now().digest);
  asked.contents.add_to(digest);
  Outcome<std::shared_ptr<Answer>> computed = collide(frame, asked, question.value());
  if (!computed) return computed.fault();
  // Nothing that follows can fail: the collider is where the frame has it.
  std::shared_ptr<Answer> answer = std::move(computed).value();
  answer->queue_ms = 1e3 * waited.count();
  answer->memory = Holding(account_, answer->memory_bytes());
  answer->state_before = history_.now();
  count(*answer, waited.count());
  // What comes next builds what a placement dropped.
  if (asked.question.kind != QuestionKind::kPlace) forecast_.stepped();
  if (!frame.counts()) {
    answer->state = history_.now();
    if (frame.moves()) history_.keep_trial(digest.value());
    return std::shared_ptr<const Answer>(std::move(answer));
  }
  answer->state = {frame.number, history_.now().revision, digest.value()};
  return finish(std::move(answer), std::move(asked));
}

FrameOutcome Session::finish(std::shared_ptr<const Answer> answer, FrameContent content) noexcept {
  std::optional<FrameContent> replaced(std::move(content));
  const std::shared_ptr<const Answer>& finished = history_.finish(std::move(answer), replaced);
  auto* const question = replaced ? std::get_if<FrameQuestion>(&*replaced) : nullptr;
  if (question != nullptr) spare_.keep(question->contents.release());
  return finished;
}

std::string Session::why_no_more_contacts(const ColliderOptions& asked) const {
  if (asked.max_contacts <
      most_contacts(limits_.max_session_bytes, asked.explain, asked.fields, asked.reduced))
    return {};
  return "; with these fields the daemon's max-session-bytes has room for no more";
}

Outcome<std::shared_ptr<Answer>> Session::collide(const AdmittedFrame& frame, FrameQuestion& asked,
                                                  const Question& question) {
  const Scene& scene = collider_.scene();
  const ContactFields fields = merged(collider_.options(), question).fields;
  // Made before the step is taken: where there is no memory for it, or nobody could be told, the frame did
  // not happen.
  std::shared_ptr<Answer> answer;
  const char* limit = kMaxContacts;
  const auto accept = [&](const StepResult& step) -> Status {
    const std::size_t bytes = contact_bytes(step, fields);
    if (bytes > frame.pass.max_answer_bytes) {
      limit = kMaxMessageBytes;
      return answer_too_long(bytes);
    }
    answer = std::make_shared<Answer>(make_answer(frame.number, scene, step, fields));
    return {};
  };
  const Result<StepResult> result = [&] {
    const Running running(*this, frame.pass.given_up.get());
    return collider_.ask(asked.contents.view(), question, running.stop(), accept);
  }();
  if (!result && result.error().code == ErrorCode::kCancelled) return given_up(frame_name(frame.number));
  if (!result) {
    Fault fault = fault_from(result.error(), frame_name(frame.number) + ": ", limit);
    if (result.error().code == ErrorCode::kResourceExhausted && limit == kMaxContacts)
      fault.message += why_no_more_contacts(merged(collider_.options(), question));
    return fault;
  }
  answer->statistics = result.value().statistics;
  answer->keep_distance = question.options.keep_distance;
  if (result.value().all_deformable)
    answer->all_deformable.emplace(
        Answer::AllDeformable{*result.value().all_deformable, asked.contents.bytes(),
                              std::size_t{3} * scene.vertex_count() * size_of(dtype_)});
  return answer;
}

void Session::count(const Answer& answer, double waited_seconds) {
  std::optional<StepCounts> beside;
  if (answer.all_deformable) beside = answer.all_deformable->statistics.counts;
  forecast_.computed(answer.statistics.counts, beside);
  ++steps_unchecked_;
  if (observer_ != nullptr) observer_->step_done(answer.statistics, answer.pairs(), waited_seconds);
  if (tenant() == nullptr) return;
  tenant()->steps.fetch_add(1, std::memory_order_relaxed);
  tenant()->step_nanoseconds.fetch_add(static_cast<std::uint64_t>(1e6 * answer.statistics.ms.total),
                                       std::memory_order_relaxed);
}

FrameOutcome Session::take_trial(std::uint64_t number, FrameCommit commit) {
  const std::string where = frame_name(number) + ": ";
  const double fraction = commit.fraction;
  const std::optional<std::uint64_t> trial = history_.trial();
  const bool is_fraction = fraction >= 0 && fraction <= 1;  // what is none is for the collider to refuse
  if (is_fraction && !trial)
    return Fault{ErrorCode::kFailedPrecondition, Reason::kInvalidInput,
                 where +
                     "no trial of this frame was answered since the last frame or change of the scene or its "
                     "options, or a "
                     "motion failed since; send the trial again, then the commit"};
  auto answer = std::make_shared<Answer>();
  const Result<CommitResult> result = collider_.commit(fraction, rounding());
  if (!result) return fault_from(result.error(), where);
  StateDigest digest(history_.now().digest);
  digest.add(kDigestOfCommit);
  digest.add(*trial);
  digest.add(std::bit_cast<std::uint64_t>(fraction == 0 ? 0.0 : fraction));
  answer->frame = number;
  answer->vf = result.value().vf.value_or(0);
  answer->ee = result.value().ee.value_or(0);
  answer->vh = result.value().vh.value_or(0);
  answer->possible = result.value().possible.value_or(0);
  answer->commit_counted = result.value().vf.has_value();
  answer->earliest_toi = result.value().earliest_toi;
  answer->state = {number, history_.now().revision, digest.value()};
  answer->state_before = history_.now();
  forecast_.stepped();
  return finish(std::move(answer), commit);
}

}  // namespace warmfront::server

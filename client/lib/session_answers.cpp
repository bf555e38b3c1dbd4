// SPDX-License-Identifier: Apache-2.0
// What the daemon answers: an answer's parts, refusals, and what they settle. Thread safety as stated in
// session_impl.h.
#include <algorithm>
#include <bit>
#include <utility>

#include "client/lib/frame_cost.h"
#include "client/lib/session_impl.h"

namespace warmfront::client {
namespace {

/// What an older daemon did not read of the question, and answered as if it had not been asked. By the
/// answer, and not by the features that a daemon lists before: behind a proxy another one may answer.
std::optional<Error> ignored_by_older(const Question& question, const Answer& answer,
                                      const v1::StepSummary& summary) {
  if (question.options.reduced && answer.contacts.size() > 0 && answer.contacts.multiplicity.empty())
    return Error{
        ErrorCode::kUnimplemented,
        "reduced: the daemon is older than it, and lists each closest pair as often as rows have it; "
        "update it, or ask without"};
  if (question.options.keep_distance && !summary.has_keep_distance())
    return Error{
        ErrorCode::kUnimplemented,
        "keep_distance: the daemon is older than it, and answers as if nothing but contact were to be "
        "kept from; update it, or ask without"};
  return std::nullopt;
}

/// What an answer lists, in bytes.
std::size_t listed_bytes(const Answer& answer) {
  const ContactTable& rows = answer.contacts;
  const auto size = [](const auto& column) { return column.size() * sizeof(column[0]); };
  return size(rows.kind) + size(rows.status) + size(rows.vertices) + size(rows.edge_faces) + size(rows.toi) +
         size(rows.weights) + size(rows.normal) + size(rows.points) + size(rows.direction) +
         size(rows.squared_distance) + size(rows.closest) + size(rows.multiplicity) + size(rows.stencil) +
         size(answer.vertex_distances) + size(answer.worlds) + size(answer.world_tois);
}

/// Room for such an answer, and for one that is somewhat longer.
std::size_t room_for(const Answer& answer) {
  constexpr std::size_t kBetweenColumns = 1024;
  const std::size_t bytes = listed_bytes(answer);
  return std::bit_ceil(bytes + bytes / 2 + kBetweenColumns);
}

}  // namespace

void Session::Impl::take(v1::StreamStepsResponse& response) {
  switch (response.message_case()) {
    case v1::StreamStepsResponse::kAnswer:
      return take_answer(response.answer());
    case v1::StreamStepsResponse::kError: {
      RemoteError error = remote_error_from(response.error().status());
      // Losing the session also ends the stream: read it to its end, then resume.
      if (error.lost_session()) return;
      // The daemon stops before it has computed the frame, and another one does.
      if (error.reason == v1::ERROR_REASON_DRAINING) {
        lost_ = std::move(error);
        return;
      }
      // This session's next frame: a copy that answered it differently, or expects another, is not this
      // session.
      const bool due = response.error().frame() == header_.first_frame() + 1;
      // So is one that does not know the trial that this is about.
      const bool trial_lost = due && unanswered_.front().needs_trial() && last_trial_ &&
                              error.error.code == ErrorCode::kFailedPrecondition;
      if (error.other_state() || trial_lost || (due && error.reason == v1::ERROR_REASON_FRAME_OUT_OF_ORDER)) {
        error.reason = v1::ERROR_REASON_STATE_CHANGED;
        lost_ = std::move(error);
        return;
      }
      return take_error(response.error());
    }
    case v1::StreamStepsResponse::kDraining:
      draining_ = true;
      writable_ = false;
      return;
    default:
      return end_with({ErrorCode::kInternal, "the daemon sent an unexpected message"});
  }
}

void Session::Impl::take_answer(const v1::StepAnswer& part) {
  const Stopwatch decoding;
  SentFrame& frame = unanswered_.front();
  if (part.frame() != frame.number)
    return end_with({ErrorCode::kInternal, "the daemon answered " + frame_name(part.frame()) + " where " +
                                               frame_name(frame.number) + " is due"});
  if (const Status appended = append_part(part, partial_, frame.answer_room); !appended)
    return end_with(appended.error());
  partial_.travel.received_bytes += part.ByteSizeLong();
  if (part.last() && part.has_shared()) partial_.travel.received_bytes += listed_bytes(partial_);
  if (part.last()) {
    if (const Status finished = finish_answer(part, partial_); !finished) return end_with(finished.error());
  }
  partial_.travel.decode_ms += decoding.milliseconds();
  if (!part.last()) return;
  if (!part.has_shared()) wanted_room_ = std::max(wanted_room_, room_for(partial_));
  frame.answer_room.reset();
  frame.moved_block.reset();
  const v1::StepSummary& summary = part.summary();
  if (known_ && !same_state(summary.state_before(), *known_)) {
    lost_ = RemoteError{
        {ErrorCode::kAborted, frame_name(frame.number) + " was stepped from another state: session " + id() +
                                  " is also changed by another client"},
        v1::ERROR_REASON_STATE_CHANGED};
    return;
  }
  if (known_ && !frame.counts() && !same_state(summary.state(), *known_))
    return end_with({ErrorCode::kUnimplemented, "the daemon is too old for trials: it took one for a step"});
  if (known_) known_ = summary.state();
  partial_.travel.encode_ms = frame.encode_ms;
  partial_.travel.sent_bytes = frame.sent_bytes;
  if (frame.commit) {
    if (!last_trial_) return end_with({ErrorCode::kInternal, "the daemon answered a commit of no trial"});
    partial_.commit = last_trial_->up_to(*frame.commit);
    state_.take(last_trial_->frame(), *frame.commit);
  } else if (frame.counts()) {
    state_.take(frame);
  }
  if (frame.counts()) header_.set_first_frame(frame.number);
  const std::shared_ptr<PendingAnswer> asked = std::move(frame.asked);  // none of a trial sent again
  const std::optional<Error> ignored = ignored_by_older(frame.question, partial_, summary);
  if (frame.counts())
    last_trial_.reset();
  else if (asked && frame.is_trial())
    last_trial_.emplace(std::move(frame), partial_);
  unanswered_.pop_front();
  --sent_;
  Answer answer = std::exchange(partial_, {});
  if (!asked) return;
  resumes_without_answer_ = 0;
  if (ignored)
    asked->settle(*ignored);
  else
    asked->settle(std::move(answer));
}

void Session::Impl::take_error(const v1::StepError& message) {
  const RemoteError remote = remote_error_from(message.status());
  if (message.frame() != unanswered_.front().number)
    return end_with({ErrorCode::kInternal, "the daemon refused " + frame_name(message.frame()) + " where " +
                                               frame_name(unanswered_.front().number) +
                                               " is due: " + remote.error.message});
  // The engine failed on this frame and the session is gone: creating it again would fail in the same way.
  if (remote.reason == v1::ERROR_REASON_ENGINE) return end_with(remote.error);
  --sent_;
  // Its commit is refused then, and the session resumed.
  if (unanswered_.front().answered) {
    partial_ = {};
    return unanswered_.pop_front();
  }
  settle_refused(remote.error);
}

void Session::Impl::settle_refused(Error error) {
  const SentFrame frame = std::move(unanswered_.front());
  unanswered_.pop_front();
  partial_ = {};
  resumes_without_answer_ = 0;
  // What was sent after a frame that does not count is out of order, trials too.
  frame_failed_ = (frame_failed_ || frame.counts()) && !unanswered_.empty();
  if (frame.counts() ? !frame.commit : frame.is_trial()) last_trial_.reset();
  if (frame.is_trial() && std::ranges::none_of(unanswered_, &SentFrame::is_trial)) may_commit_ = false;
  // The trial stands where only the fraction was wrong.
  const auto moves = [](const SentFrame& behind) { return behind.counts() || behind.is_trial(); };
  if (frame.commit && std::ranges::none_of(unanswered_, moves)) may_commit_ = last_trial_.has_value();
  frame.asked->settle(std::move(error));
}

void Session::Impl::give_up(const Error& why) {
  drop_stream();
  const bool is_trial = unanswered_.front().is_trial();
  settle_refused({why.code, frame_name(unanswered_.front().number) + ": " + why.message});
  if (!is_trial) return;
  // What is about this trial is not sent: the daemon would take the one before.
  const auto moves = [](const SentFrame& frame) { return frame.is_trial() || frame.counts(); };
  for (auto frame = unanswered_.begin(); frame != unanswered_.end();) {
    if (frame->needs_trial()) {
      const bool counts = frame->counts();
      frame->asked->settle(
          Error{LastTrial::none().code, frame_name(frame->number) + ": " + LastTrial::none().message});
      frame = unanswered_.erase(frame);
      if (!counts) continue;
      frame_failed_ = !unanswered_.empty();
      break;
    }
    if (moves(*frame)) break;
    ++frame;
  }
}

}  // namespace warmfront::client

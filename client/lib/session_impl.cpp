// SPDX-License-Identifier: Apache-2.0
// The life of a session, and waiting for it. What is asked: session_questions.cpp; what is answered:
// session_answers.cpp; changes of the scene: session_changes.cpp; resuming: session_resume.cpp. Thread safety
// as stated in the header.
#include "client/lib/session_impl.h"

#include <algorithm>
#include <utility>

#include "client/lib/frame_cost.h"

namespace warmfront::client {

Session::Impl::Impl(std::shared_ptr<Connection> connection, v1::SessionHeader header, SceneState state,
                    std::string traceparent)
    : connection_(std::move(connection)),
      traceparent_(std::move(traceparent)),
      header_(std::move(header)),
      state_(std::move(state)) {}

Session::Impl::~Impl() {
  static_cast<void>(close());
}

Result<Answer> Session::Impl::next_answer() {
  if (submitted_.empty())
    return failed_.value_or(
        Error{ErrorCode::kFailedPrecondition, "no frame is unanswered; submit one first"});
  const std::shared_ptr<PendingAnswer> oldest = std::move(submitted_.front());
  submitted_.pop_front();
  return oldest->take();
}

Result<std::vector<double>> Session::Impl::positions() const {
  if (Status idle = check_idle(); !idle) return idle.error();
  return state_.placed();
}

Result<std::vector<BodyPose>> Session::Impl::poses() const {
  if (Status idle = check_idle(); !idle) return idle.error();
  return state_.poses();
}

void Session::Impl::wait(PendingAnswer& asked, PendingAnswer::Time until) {
  until_ = until;
  while (!asked.settled() && !failed_) {
    try {
      advance();
    } catch (const GivenUp& given_up) {
      give_up(given_up.why);
    } catch (const WaitedEnough&) {
      if (!stream_ || !stream_->whole()) drop_stream();
      break;
    }
  }
  until_ = PendingAnswer::Time::max();
  if (!asked.settled() && failed_) asked.settle(*failed_);
}

StepStream::Deadline Session::Impl::look() {
  const PendingAnswer::Time now = PendingAnswer::Clock::now();
  PendingAnswer::Time next = until_;
  if (const auto due = std::ranges::find(unanswered_, false, &SentFrame::answered);
      due != unanswered_.end()) {
    if (const std::optional<Error> why = due->asked->given_up(now)) throw GivenUp{*why};
    next = std::min(next, due->asked->next_look(now));
  }
  if (now >= until_) throw WaitedEnough();
  if (next == PendingAnswer::Time::max()) return StepStream::Deadline::max();
  return deadline_after(next - now);
}

void Session::Impl::advance() {
  // Dropped for a question that was given up, or in the middle of something.
  if (!stream_ && !establish(Full::kWaits)) return;
  send_frames();
  RemoteError lost{{ErrorCode::kUnavailable, "the daemon is draining"}};
  if (lost_) {
    lost = *std::exchange(lost_, std::nullopt);
  } else if (!(draining_ && sent_ == 0)) {
    v1::StreamStepsResponse response;
    const StepStream::Event event =
        stream_->read(response, deadline_after(connection_->options().answer_timeout));
    if (event == StepStream::Event::kDone) return take(response);
    lost = event == StepStream::Event::kEnded
               ? ended()
               : RemoteError{{ErrorCode::kDeadlineExceeded, frame_name(unanswered_.front().number) +
                                                                ": no answer within the answer timeout"}};
  }
  static_cast<void>(resume(lost));  // or the session has failed
}

void Session::Impl::drop_stream() {
  stream_.reset();
  sent_ = 0;
  partial_ = {};
  lost_.reset();
  writable_ = false;
  draining_ = false;
  drop_trial_sent_again();
}

Status Session::Impl::close() {
  if (failed_) return *failed_;
  failed_ = Error{ErrorCode::kFailedPrecondition, "the session is closed"};
  stream_.reset();
  unanswered_.clear();
  submitted_.clear();
  const std::optional<RemoteError> error = connection_->remove(id());
  // Already deleted: not an error.
  if (error && error->reason != v1::ERROR_REASON_SESSION_NOT_FOUND) return error->error;
  return {};
}

}  // namespace warmfront::client

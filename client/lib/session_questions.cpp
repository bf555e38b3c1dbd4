// SPDX-License-Identifier: Apache-2.0
// What is asked: the checks before it is sent, and the frames that are sent. Thread safety as stated in
// session_impl.h.
#include <algorithm>
#include <utility>

#include "client/lib/frame_cost.h"
#include "client/lib/session_impl.h"
#include "engine/digits.h"

namespace warmfront::client {

std::uint64_t Session::Impl::next_number() const {
  return header_.first_frame() + 1 +
         static_cast<std::uint64_t>(std::ranges::count_if(unanswered_, &SentFrame::counts));
}

/// A question's place in its session.
class Session::Impl::Asked final : public PendingAnswer {
 public:
  Asked(std::weak_ptr<Impl> session, const WaitOptions& wait, bool handed_out)
      : PendingAnswer(wait, handed_out), session_(std::move(session)) {}

  bool wait_until(Time until) override {
    if (settled()) return true;
    if (const std::shared_ptr<Impl> session = session_.lock())
      session->wait(*this, until);
    else
      settle(Error{ErrorCode::kFailedPrecondition, "the session was closed before the answer"});
    return settled();
  }

 private:
  const std::weak_ptr<Impl> session_;
};

std::shared_ptr<PendingAnswer> Session::Impl::asked(const WaitOptions& wait, bool handed_out) {
  return std::make_shared<Asked>(weak_from_this(), wait, handed_out);
}

Status Session::Impl::check_may_ask(const WaitOptions& wait) const {
  if (failed_) return *failed_;
  if (!submitted_.empty())
    return Error{ErrorCode::kFailedPrecondition,
                 "frames are unanswered; take their answers before a single step"};
  return PendingAnswer::check(wait);
}

Status Session::Impl::check_may_submit() const {
  if (failed_) return *failed_;
  if (std::max(unanswered_.size(), submitted_.size()) < window_) return {};
  return Error{
      ErrorCode::kFailedPrecondition,
      std::to_string(window_) +
          " frames are unanswered, which is the daemon's window; take an answer before sending more"};
}

std::shared_ptr<PendingAnswer> Session::Impl::ask(const Frame& frame, const Question& question,
                                                  const WaitOptions& wait, bool handed_out) {
  if (Status may = check_may_ask(wait); !may) return std::make_shared<PendingAnswer>(may.error());
  if (std::shared_ptr<PendingAnswer> behind = refused_.refuse_behind(handed_out, next_number())) {
    if (!question.of_state()) may_commit_ = false;
    return behind;
  }
  std::shared_ptr<PendingAnswer> answer = asked(wait, handed_out);
  if (Result<std::uint64_t> number = encode_and_send(frame, question, answer); !number)
    return refused_.refuse(number.error(), question.counts(), handed_out);
  return answer;
}

std::shared_ptr<PendingAnswer> Session::Impl::ask_commit(double fraction, const WaitOptions& wait,
                                                         bool handed_out) {
  if (Status may = check_may_ask(wait); !may) return std::make_shared<PendingAnswer>(may.error());
  if (std::shared_ptr<PendingAnswer> behind = refused_.refuse_behind(handed_out, next_number()))
    return behind;
  std::shared_ptr<PendingAnswer> answer = asked(wait, handed_out);
  if (Result<std::uint64_t> number = send_commit(fraction, answer); !number)
    return refused_.refuse(number.error(), true, handed_out);
  return answer;
}

Result<std::uint64_t> Session::Impl::submit(const Frame& frame, const Question& question) {
  if (Status may = check_may_submit(); !may) return may.error();
  std::shared_ptr<PendingAnswer> answer = asked({}, false);
  Result<std::uint64_t> number = encode_and_send(frame, question, answer);
  if (number) submitted_.push_back(std::move(answer));
  return number;
}

Result<std::uint64_t> Session::Impl::submit_commit(double fraction) {
  if (Status may = check_may_submit(); !may) return may.error();
  std::shared_ptr<PendingAnswer> answer = asked({}, false);
  Result<std::uint64_t> number = send_commit(fraction, answer);
  if (number) submitted_.push_back(std::move(answer));
  return number;
}

Result<std::uint64_t> Session::Impl::encode_and_send(const Frame& frame, const Question& question,
                                                     std::shared_ptr<PendingAnswer> asked) {
  enlarge_rooms();
  // What has begun is to be followed by its rest, and by nothing else.
  struct Begun {
    ~Begun() {
      if (session.stream_ && session.stream_->begun()) session.drop_stream();
    }
    Impl& session;
  } const begun{*this};
  begin_frame(frame, question);
  const Stopwatch encoding;
  Result<SentFrame> sent = state_.encode(frame, stream_ ? stream_->region() : nullptr);
  if (!sent) {
    may_commit_ = false;  // as after any motion that fails
    return Error{sent.error().code, frame_name(next_number()) + ": " + sent.error().message};
  }
  sent.value().question = question;
  sent.value().asked = std::move(asked);
  sent.value().encode_ms = encoding.milliseconds();
  const bool moves = !question.of_state();
  Result<std::uint64_t> number = send(std::move(sent).value());
  if (number && moves) may_commit_ = !question.counts();
  return number;
}

void Session::Impl::begin_frame(const Frame& frame, const Question& question) {
  if (!attached_.shared_memory().early_frames() || !stream_ || stream_->region() == nullptr ||
      !unanswered_.empty() || !writable_ || frame_failed_ || !known_ ||
      state_.positions().size() < connection_->options().early_frame_bytes || !state_.gives_all(frame))
    return;
  writer().begin(next_number(), question);
}

Result<std::uint64_t> Session::Impl::send_commit(double fraction, std::shared_ptr<PendingAnswer> asked) {
  SentFrame commit;
  commit.commit = fraction;
  commit.asked = std::move(asked);
  Result<std::uint64_t> number = send(std::move(commit));
  if (number) may_commit_ = false;
  return number;
}

Result<std::uint64_t> Session::Impl::send(SentFrame frame) {
  if (frame_failed_)
    return Error{ErrorCode::kFailedPrecondition,
                 "a frame failed, and frames were sent after it; take their answers before sending more"};
  // A daemon that states nothing of a session is older than questions, and would take a trial for a step.
  if (!known_ && (frame.commit || frame.question != Question()))
    return Error{ErrorCode::kUnimplemented, "the daemon is too old for trials and for options of a step"};
  // The daemon may have an earlier trial than this session, where a later one was given up.
  if (frame.needs_trial() && (!may_commit_ || (unanswered_.empty() && !last_trial_))) {
    // The engine looks at the fraction first.
    if (frame.commit && !(*frame.commit >= 0 && *frame.commit <= 1))
      return invalid_argument(frame_name(next_number()) + ": fraction: " + digits_of(*frame.commit) +
                              " is not in [0, 1]");
    return LastTrial::none();
  }
  const std::uint64_t number = next_number();
  frame.number = number;
  unanswered_.push_back(std::move(frame));
  try {
    send_frames();
  } catch (const GivenUp& given_up) {
    give_up(given_up.why);
  }
  return number;
}

void Session::Impl::enlarge_rooms() {
  if (wanted_room_ <= room_ || !unanswered_.empty() || !stream_ || stream_->region() == nullptr) return;
  room_ = wanted_room_;
  stream_->ask_for_memory(memory_for(room_));
}

FrameWriter Session::Impl::writer() {
  return {*stream_, chunk_bytes_, connection_->options().answer_timeout, room_,
          attached_.shared_memory().moved()};
}

void Session::Impl::send_frames() {
  if (!stream_) return;
  FrameWriter writer = this->writer();
  while (writable_ && sent_ < unanswered_.size() && sent_ < window_) {
    if (!writer.write(unanswered_[sent_])) {
      writable_ = false;
      return;
    }
    ++sent_;
  }
}

}  // namespace warmfront::client

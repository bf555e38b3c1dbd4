// SPDX-License-Identifier: Apache-2.0
// Frames and answers of a session. Resuming is in session_resume.cpp. Thread safety as stated in the header.
#include "client/lib/session_impl.h"

#include <algorithm>
#include <chrono>
#include <utility>

#include "client/lib/frame_message.h"
#include "client/lib/uuid.h"
#include "proto/byte_buffer.h"

namespace warmfront::client {
namespace {

std::string name_of(std::uint64_t frame) {
  return "frame " + std::to_string(frame);
}

using Clock = std::chrono::steady_clock;

Error no_trial() {
  return {ErrorCode::kFailedPrecondition,
          "no trial was answered since the last frame or change of the scene; ask for a trial first"};
}

double milliseconds_since(Clock::time_point start) {
  return std::chrono::duration<double, std::milli>(Clock::now() - start).count();
}

}  // namespace

Session::Impl::Impl(std::shared_ptr<Connection> connection, v1::SessionHeader header, SceneState state)
    : connection_(std::move(connection)), header_(std::move(header)), state_(std::move(state)) {}

Session::Impl::~Impl() {
  static_cast<void>(close());
}

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

Status Session::Impl::check_idle() const {
  if (unanswered_.empty() && submitted_.empty()) return {};
  return Error{ErrorCode::kFailedPrecondition,
               "frames are unanswered; take their answers before changing the scene"};
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

/// Refused at once, as a step, place or commit or behind one. What is asked before somebody has waited for any of
/// these was meant to begin where that one would have ended.
class Session::Impl::Refused final : public PendingAnswer {
 public:
  Refused(Error why, std::shared_ptr<bool> seen) : PendingAnswer(std::move(why)), seen_(std::move(seen)) {}
  bool wait_until(Time /*until*/) override { return *seen_ = true; }

 private:
  const std::shared_ptr<bool> seen_;
};

std::shared_ptr<PendingAnswer> Session::Impl::refused(Error why, bool counts, bool handed_out) {
  if (!counts || !handed_out) return std::make_shared<PendingAnswer>(std::move(why));
  refusal_seen_ = std::make_shared<bool>(false);
  return std::make_shared<Refused>(std::move(why), refusal_seen_);
}

// A question whose caller waits for its answer is told of it once.
std::shared_ptr<PendingAnswer> Session::Impl::behind_refused(bool handed_out) {
  const std::shared_ptr<bool> seen = handed_out ? refusal_seen_ : std::exchange(refusal_seen_, nullptr);
  if (seen == nullptr || *seen) return nullptr;
  return std::make_shared<Refused>(
      Error{ErrorCode::kFailedPrecondition,
            "a frame before it failed, and frame " + std::to_string(next_number()) + " is the next one"},
      seen);
}

std::shared_ptr<PendingAnswer> Session::Impl::ask(const Frame& frame, const Question& question,
                                                  const WaitOptions& wait, bool handed_out) {
  if (Status may = check_may_ask(wait); !may) return std::make_shared<PendingAnswer>(may.error());
  if (std::shared_ptr<PendingAnswer> behind = behind_refused(handed_out)) {
    if (!question.of_state()) may_commit_ = false;
    return behind;
  }
  std::shared_ptr<PendingAnswer> answer = asked(wait, handed_out);
  if (Result<std::uint64_t> number = encode_and_send(frame, question, answer); !number)
    return refused(number.error(), question.counts(), handed_out);
  return answer;
}

std::shared_ptr<PendingAnswer> Session::Impl::ask_commit(double fraction, const WaitOptions& wait,
                                                         bool handed_out) {
  if (Status may = check_may_ask(wait); !may) return std::make_shared<PendingAnswer>(may.error());
  if (std::shared_ptr<PendingAnswer> behind = behind_refused(handed_out)) return behind;
  std::shared_ptr<PendingAnswer> answer = asked(wait, handed_out);
  if (Result<std::uint64_t> number = send_commit(fraction, answer); !number)
    return refused(number.error(), true, handed_out);
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
  const Clock::time_point start = Clock::now();
  Result<SentFrame> sent = state_.encode(frame);
  if (!sent) {
    may_commit_ = false;  // as after any motion that fails
    return Error{sent.error().code, name_of(next_number()) + ": " + sent.error().message};
  }
  sent.value().question = question;
  sent.value().asked = std::move(asked);
  sent.value().encode_ms = milliseconds_since(start);
  const bool moves = !question.of_state();
  Result<std::uint64_t> number = send(std::move(sent).value());
  if (number && moves) may_commit_ = !question.counts();
  return number;
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
  if (frame.needs_trial() && (!may_commit_ || (unanswered_.empty() && !last_trial_))) return no_trial();
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

void Session::Impl::send_frames() {
  while (stream_ && writable_ && sent_ < unanswered_.size() && sent_ < window_) {
    if (!send_frame(unanswered_[sent_])) {
      writable_ = false;
      return;
    }
    ++sent_;
  }
}

bool Session::Impl::send_frame(SentFrame& frame) {
  Clock::time_point encoding_since = Clock::now();
  const auto write = [&](const grpc::ByteBuffer& message) {
    frame.sent_bytes += message.Length();
    frame.encode_ms += milliseconds_since(encoding_since);
    const StepStream::Event event = stream_->write(message, connection_->options().answer_timeout);
    encoding_since = Clock::now();
    return event == StepStream::Event::kDone;
  };
  v1::StreamStepsRequest request;
  if (frame.commit) {
    request.mutable_commit()->set_frame(frame.number);
    request.mutable_commit()->set_fraction(*frame.commit);
    return write(serialize(request));
  }
  // With the first message of the frame.
  std::optional<v1::Question> question;
  if (frame.question != Question()) question = to_proto(frame.question);
  if (!frame.moved) {
    const std::size_t size = frame.positions->size();
    std::size_t at = 0;
    do {
      const std::size_t count = std::min(chunk_bytes_, size - at);
      const bool more = at + count < size;
      const v1::Question* asked = at == 0 && question ? &*question : nullptr;
      if (!write(positions_message(frame.number, more, frame.positions, at, count, asked))) return false;
      at += count;
    } while (at < size);
    return true;
  }
  v1::StepFrame& step = *request.mutable_step();
  step.set_frame(frame.number);
  if (question) *step.mutable_question() = *question;
  const auto write_step = [&](bool more) {
    step.set_more(more);
    const bool written = write(serialize(request));
    step.clear_question();
    return written;
  };
  const v1::MovedParts& moved = *frame.moved;
  if (moved.ByteSizeLong() <= chunk_bytes_) {
    *step.mutable_moved() = moved;
    return write_step(false);
  }
  // Field by field, chunk by chunk; an empty last part ends the frame.
  using Parts = v1::MovedParts;
  const auto send = [&](const std::string& bytes, auto set) {
    for (std::size_t at = 0; at < bytes.size(); at += chunk_bytes_) {
      step.clear_moved();
      set(*step.mutable_moved(), bytes.substr(at, chunk_bytes_));
      if (!write_step(true)) return false;
    }
    return true;
  };
  if (!send(moved.bodies(), [](Parts& to, std::string piece) { to.set_bodies(std::move(piece)); }) ||
      !send(moved.body_positions(),
            [](Parts& to, std::string piece) { to.set_body_positions(std::move(piece)); }) ||
      !send(moved.pose_bodies(),
            [](Parts& to, std::string piece) { to.set_pose_bodies(std::move(piece)); }) ||
      !send(moved.poses(), [](Parts& to, std::string piece) { to.set_poses(std::move(piece)); }) ||
      !send(moved.vertices(), [](Parts& to, std::string piece) { to.set_vertices(std::move(piece)); }) ||
      !send(moved.vertex_positions(),
            [](Parts& to, std::string piece) { to.set_vertex_positions(std::move(piece)); }))
    return false;
  step.clear_moved();
  return write_step(false);
}

Status Session::Impl::change(v1::SceneChange change, const std::function<void()>& taken) {
  v1::ChangeSceneRequest request;
  *request.add_changes() = std::move(change);
  return this->change(std::move(request), taken);
}

Status Session::Impl::change(v1::ChangeSceneRequest request, const std::function<void()>& taken) {
  if (failed_) return *failed_;
  if (Status idle = check_idle(); !idle) return idle;
  request.set_session_id(id());
  request.set_next_frame(header_.first_frame() + 1);
  request.set_key(random_uuid());
  changing_ = true;
  for (;;) {
    request.clear_expected_state();
    if (known_) *request.mutable_expected_state() = *known_;
    v1::ChangeSceneResponse response;
    std::optional<RemoteError> error = connection_->change(request, response);
    if (!error) {
      changing_ = false;
      last_trial_.reset();
      taken();
      header_.set_first_revision(header_.first_revision() + 1);
      known_ = response.has_state() ? std::optional(response.state()) : std::nullopt;
      resumes_without_answer_ = 0;
      return {};
    }
    // This session's next frame: a copy that expects another one is not this session.
    if (error->reason == v1::ERROR_REASON_FRAME_OUT_OF_ORDER) error->reason = v1::ERROR_REASON_STATE_CHANGED;
    const bool refused = error->retry_after || !error->may_resume();
    const Status resumed = refused ? Status{} : resume(*error);
    if (refused || !resumed) {
      changing_ = false;
      return refused ? error->error : resumed.error();
    }
  }
}

Result<std::uint32_t> Session::Impl::add_body(BodyAddition addition, const Positions& positions) {
  may_commit_ = false;  // whether or not it fails, as with Collider
  Result<v1::SceneChange> encoded = state_.encode(addition, positions);
  if (!encoded) return encoded.error();
  if (Status known = need_for(addition); !known) return known.error();
  const auto index = static_cast<std::uint32_t>(state_.scene().bodies.size());
  if (Status changed =
          change(std::move(encoded).value(), [&] { state_.take(std::move(addition), positions); });
      !changed)
    return changed.error();
  return index;
}

// What a daemon must know to take such a body.
Status Session::Impl::need_for(const BodyAddition& body) {
  if (body.body.thickness != 0) {
    if (Status known = need(v1::FEATURE_THICKNESS); !known) return known;
  }
  if (!body.thickness.empty()) {
    if (Status known = need(v1::FEATURE_REPLACE); !known) return known;
  }
  if (body.body.world != 0) {
    if (Status known = need(v1::FEATURE_WORLDS); !known) return known;
  }
  if (body.body.half_space) {
    if (Status known = need(v1::FEATURE_HALF_SPACES); !known) return known;
  }
  return body.edges.empty() ? Status{} : need(v1::FEATURE_EDGES);
}

Status Session::Impl::replace_elements(ReplaceElements replacement) {
  may_commit_ = false;
  Result<v1::SceneChange> encoded = state_.encode(replacement);
  if (!encoded) return encoded.error();
  if (Status known = need(v1::FEATURE_REPLACE); !known) return known;
  return change(std::move(encoded).value(), [&] { state_.take(std::move(replacement)); });
}

Status Session::Impl::replace_body(std::uint32_t index, BodyAddition with, const Positions& positions) {
  may_commit_ = false;
  Result<v1::SceneChange> encoded = state_.encode(index, with, positions);
  if (!encoded) return encoded.error();
  if (Status known = need(v1::FEATURE_REPLACE); !known) return known;
  if (Status known = need_for(with); !known) return known;
  return change(std::move(encoded).value(), [&] { state_.take(index, std::move(with), positions); });
}

Status Session::Impl::change_body(std::uint32_t index, Body body) {
  may_commit_ = false;
  if (Status status = state_.check_change(index, body); !status) return status;
  if (body.thickness != 0) {
    if (Status known = need(v1::FEATURE_THICKNESS); !known) return known;
  }
  if (body.world != 0) {
    if (Status known = need(v1::FEATURE_WORLDS); !known) return known;
  }
  v1::SceneChange encoded;
  encoded.mutable_change()->set_index(index);
  *encoded.mutable_change()->mutable_body() = to_proto(body);
  // The daemon keeps the range and ignores this field, but it must not be empty where the body has a mesh.
  encoded.mutable_change()->mutable_body()->set_vertex_count(state_.scene().bodies[index].vertex_count);
  return change(std::move(encoded), [&] { state_.take(index, std::move(body)); });
}

// Of a daemon that is not there the change itself will tell.
Status Session::Impl::need(v1::Feature feature) {
  if (failed_) return *failed_;
  const std::optional<RemoteError> error = connection_->need({&feature, 1}, id());
  if (error && error->error.code == ErrorCode::kUnimplemented) return error->error;
  return {};
}

Status Session::Impl::change_filters(PairFilters filters) {
  may_commit_ = false;
  if (filters.any()) {
    if (Status known = need(v1::FEATURE_PAIR_FILTERS); !known) return known;
  }
  v1::SceneChange encoded;
  *encoded.mutable_change_filters() = to_proto(filters);
  return change(std::move(encoded), [&] { state_.take(std::move(filters)); });
}

Status Session::Impl::change_excluded_pairs(std::vector<std::array<std::uint32_t, 2>> pairs) {
  may_commit_ = false;
  if (Status known = need(v1::FEATURE_OPTION_CHANGES); !known) return known;
  v1::SceneChange encoded;
  wire::set_body_pairs(*encoded.mutable_change_excluded_pairs()->mutable_pairs(), pairs);
  return change(std::move(encoded), [&] { state_.take_excluded_pairs(std::move(pairs)); });
}

Status Session::Impl::change_options(const ColliderOptions& options) {
  may_commit_ = false;
  if (Status known = need(v1::FEATURE_OPTION_CHANGES); !known) return known;
  v1::ChangeSceneRequest request;
  *request.mutable_options() = to_proto(options);
  return change(std::move(request), [&] { *header_.mutable_options() = to_proto(options); });
}

Result<Answer> Session::Impl::next_answer() {
  if (submitted_.empty())
    return failed_.value_or(
        Error{ErrorCode::kFailedPrecondition, "no frame is unanswered; submit one first"});
  const std::shared_ptr<PendingAnswer> oldest = std::move(submitted_.front());
  submitted_.pop_front();
  return oldest->take();
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
               : RemoteError{{ErrorCode::kDeadlineExceeded,
                              name_of(unanswered_.front().number) + ": no answer within the answer timeout"}};
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

void Session::Impl::give_up(const Error& why) {
  drop_stream();
  const bool is_trial = unanswered_.front().is_trial();
  settle_refused({why.code, name_of(unanswered_.front().number) + ": " + why.message});
  if (!is_trial) return;
  // What is about this trial is not sent: the daemon would take the one before.
  const auto moves = [](const SentFrame& frame) { return frame.is_trial() || frame.counts(); };
  for (auto frame = unanswered_.begin(); frame != unanswered_.end();) {
    if (frame->needs_trial()) {
      const bool counts = frame->counts();
      frame->asked->settle(Error{no_trial().code, name_of(frame->number) + ": " + no_trial().message});
      frame = unanswered_.erase(frame);
      if (!counts) continue;
      frame_failed_ = !unanswered_.empty();
      break;
    }
    if (moves(*frame)) break;
    ++frame;
  }
}

void Session::Impl::take(v1::StreamStepsResponse& response) {
  switch (response.message_case()) {
    case v1::StreamStepsResponse::kAnswer:
      return take_answer(response.answer());
    case v1::StreamStepsResponse::kError: {
      RemoteError error = remote_error_from(response.error().status());
      // Losing the session also ends the stream: read it to its end, then resume.
      if (error.lost_session()) return;
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

// By what the caller was told: a daemon that was told of the trial again had only to count.
CommitResult Session::Impl::Trial::up_to(double fraction) const {
  CommitResult result;
  result.fraction = fraction;
  if (earliest_toi && *earliest_toi <= fraction) result.earliest_toi = earliest_toi;
  if (kind.size() == vf + ee + vh) {
    result.vf = result.ee = result.vh = result.possible = 0;
    for (std::size_t i = 0; i < kind.size(); ++i) {
      if (toi[i] > fraction) continue;
      ++*(kind[i] == ContactKind::kVertexFace        ? result.vf
          : kind[i] == ContactKind::kVertexHalfSpace ? result.vh
                                                     : result.ee);
      if (status[i] == ContactStatus::kPossible || status[i] == ContactStatus::kBudget) ++*result.possible;
    }
  } else if (fraction == 1) {
    result.vf = vf;
    result.ee = ee;
    result.vh = vh;
    result.possible = possible;
  } else if (!result.earliest_toi) {
    result.vf = result.ee = result.vh = result.possible = 0;
  }
  return result;
}

void Session::Impl::take_answer(const v1::StepAnswer& part) {
  const Clock::time_point start = Clock::now();
  SentFrame& frame = unanswered_.front();
  if (part.frame() != frame.number)
    return end_with({ErrorCode::kInternal, "the daemon answered " + name_of(part.frame()) + " where " +
                                               name_of(frame.number) + " is due"});
  if (const Status appended = append_part(part, partial_); !appended) return end_with(appended.error());
  partial_.travel.received_bytes += part.ByteSizeLong();
  if (part.last()) {
    if (const Status finished = finish_answer(part, partial_); !finished) return end_with(finished.error());
  }
  partial_.travel.decode_ms += milliseconds_since(start);
  if (!part.last()) return;
  const v1::StepSummary& summary = part.summary();
  if (known_ && !same_state(summary.state_before(), *known_)) {
    lost_ = RemoteError{
        {ErrorCode::kAborted, name_of(frame.number) + " was stepped from another state: session " + id() +
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
    state_.take(last_trial_->frame, *frame.commit);
  } else if (frame.counts()) {
    state_.take(frame);
  }
  if (frame.counts()) header_.set_first_frame(frame.number);
  const std::shared_ptr<PendingAnswer> asked = std::move(frame.asked);  // none of a trial sent again
  const bool not_reduced = frame.question.options.reduced && partial_.contacts.size() > 0 &&
                           partial_.contacts.multiplicity.empty();
  const bool not_kept = frame.question.options.keep_distance && !summary.has_keep_distance();
  if (frame.counts())
    last_trial_.reset();
  else if (asked && frame.is_trial())
    last_trial_.emplace(Trial{std::move(frame), partial_.contacts.kind, partial_.contacts.status,
                              partial_.contacts.toi, partial_.vf, partial_.ee, partial_.vh, partial_.possible,
                              partial_.earliest_toi});
  unanswered_.pop_front();
  --sent_;
  Answer answer = std::exchange(partial_, {});
  if (!asked) return;
  resumes_without_answer_ = 0;
  // By the answer, and not by what a daemon lists before: behind a proxy another one may answer.
  if (not_reduced)
    asked->settle(
        Error{ErrorCode::kUnimplemented,
              "reduced: the daemon is older than it, and lists each closest pair as often as rows have it; "
              "update it, or ask without"});
  else if (not_kept)
    asked->settle(
        Error{ErrorCode::kUnimplemented,
              "keep_distance: the daemon is older than it, and answers as if nothing but contact were to be "
              "kept from; update it, or ask without"});
  else
    asked->settle(std::move(answer));
}

void Session::Impl::take_error(const v1::StepError& message) {
  const RemoteError remote = remote_error_from(message.status());
  if (message.frame() != unanswered_.front().number)
    return end_with({ErrorCode::kInternal, "the daemon refused " + name_of(message.frame()) + " where " +
                                               name_of(unanswered_.front().number) +
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
  if (frame.commit && unanswered_.empty()) may_commit_ = last_trial_.has_value();
  frame.asked->settle(std::move(error));
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

// SPDX-License-Identifier: Apache-2.0
// Creating, attaching and resuming a session. Thread safety as stated in session_impl.h.
#include <algorithm>
#include <thread>
#include <utility>

#include "client/lib/session_impl.h"

namespace warmfront::client {
namespace {

using WallClock = std::chrono::system_clock;

constexpr std::chrono::milliseconds kFirstBackoff{50};
constexpr std::chrono::milliseconds kLongestBackoff{2000};
/// Positions per message: large enough to be fast, small enough not to delay the connection's other streams.
constexpr std::size_t kFrameChunk = std::size_t{4} << 20;
/// Bytes of a message besides its bulk field.
constexpr std::size_t kMessageOverhead = 1024;

std::string in_words(std::chrono::milliseconds time) {
  const auto ms = time.count();
  return ms % 1000 == 0 ? std::to_string(ms / 1000) + " s" : std::to_string(ms) + " ms";
}

}  // namespace

Error Session::Impl::fail(Error error) {
  if (!failed_) failed_ = std::move(error);
  stream_.reset();
  unanswered_.clear();
  return *failed_;
}

RemoteError Session::Impl::ended() {
  RemoteError remote =
      remote_error_from(stream_->finish(deadline_after(connection_->options().call_timeout)));
  // A stream ends with OK only after a detach, which was not sent.
  if (remote.error.message.empty())
    remote.error = {ErrorCode::kUnavailable, "the stream ended before its answers"};
  stream_.reset();
  return remote;
}

Error Session::Impl::not_in_time(const char* done, const Error& why, const char* ended) const {
  return {ErrorCode::kUnavailable,
          "session " + id() + " could not be " + done + " within the resume timeout of " +
              in_words(connection_->options().resume_timeout) + ": " + why.message + ended};
}

Status Session::Impl::find_daemon() {
  const WallClock::time_point deadline = deadline_after(connection_->options().resume_timeout);
  for (;;) {
    v1::GetServerInfoResponse info;
    const std::optional<RemoteError> error = connection_->server_info(info, id(), looking());
    if (!error) return {};
    if (!error->may_resume()) return fail(error->error);
    if (WallClock::now() + kFirstBackoff >= deadline) return fail(not_in_time("made", error->error, ""));
    sleep(kFirstBackoff);
  }
}

Status Session::Impl::open() {
  // An upload may wait for minutes: a daemon that is not there is missed sooner.
  if (Status found = find_daemon(); !found) return found;
  const std::optional<RemoteError> error = create();
  if (error && (error->retry_after || !error->may_resume())) return fail(error->error);
  // If the connection was lost, the session may have been created nevertheless, in an unknown state.
  recreate_ = error.has_value();
  Status established = establish(Full::kFails);
  // Delete the created session: it will not be used.
  if (!established && established.error().code == ErrorCode::kResourceExhausted)
    static_cast<void>(connection_->remove(id()));
  return established;
}

Status Session::Impl::resume(const RemoteError& why) {
  stream_.reset();
  if (!why.may_resume()) return fail(why.error);
  if (why.other_state()) recreate_ = true;
  if (resumes_without_answer_ >= connection_->options().max_resumes_without_answer) {
    const std::string what = changing_ ? "a change" : "frame " + std::to_string(unanswered_.front().number);
    return fail({ErrorCode::kUnavailable, "gave up after " + std::to_string(resumes_without_answer_) +
                                              " resumes without an answer to " + what + ": " +
                                              why.error.message});
  }
  // Unary calls use another connection than the stream: they may fail each time though a stream attaches.
  if (resumes_without_answer_ > 0)
    sleep(std::min(kFirstBackoff * (1 << std::min(resumes_without_answer_ - 1, 10)), kLongestBackoff));
  ++resumes_without_answer_;
  ++resumes_;
  if (connection_->options().on_lost) connection_->options().on_lost(why.error);
  return establish(Full::kWaits);
}

void Session::Impl::sleep(std::chrono::milliseconds time) {
  const WallClock::time_point end = deadline_after(time);
  for (WallClock::time_point now = WallClock::now(); now < end; now = WallClock::now())
    std::this_thread::sleep_for(std::min(end, look()) - now);
}

Status Session::Impl::establish(Full full) {
  const WallClock::time_point deadline = deadline_after(connection_->options().resume_timeout);
  for (std::chrono::milliseconds backoff = kFirstBackoff;; backoff = std::min(2 * backoff, kLongestBackoff)) {
    const std::optional<RemoteError> error = try_establish(deadline);
    if (!error) return {};
    stream_.reset();
    // A daemon that came in place of the one before may not allow for as much.
    const char* ended = full == Full::kFails ? "" : "; it has ended: create another one, of the same scene";
    if (!error->may_resume() || (error->retry_after && full == Full::kFails)) {
      const std::string what = full == Full::kFails ? "" : "session " + id() + " could not be resumed: ";
      return fail({error->error.code, what + error->error.message + ended});
    }
    const std::chrono::milliseconds wait =
        std::max(backoff, error->retry_after.value_or(std::chrono::milliseconds(0)));
    if (WallClock::now() + wait >= deadline)
      return fail(not_in_time(full == Full::kFails ? "made" : "resumed", error->error, ended));
    sleep(wait);
  }
}

void Session::Impl::drop_trial_sent_again() {
  if (!unanswered_.empty() && unanswered_.front().answered) unanswered_.pop_front();
}

// Before a commit, or a question about the trial's end. A daemon that is ahead has carried the commit out,
// and answers it from its cache; one that does not know the trial, or lost it with the last stream, gets it
// first.
void Session::Impl::put_trial_before() {
  if (unanswered_.empty() || !unanswered_.front().needs_trial() || !last_trial_) return;
  const bool ahead = known_ && attached_.has_state() && !same_state(attached_.state(), *known_);
  if (ahead) return;
  unanswered_.push_front(last_trial_->frame());
  SentFrame& trial = unanswered_.front();
  trial.answered = true;
  // It only counts contacts: it cannot exceed a limit on listed ones, which the first daemon did not exceed.
  trial.question = {};
  trial.question.kind = QuestionKind::kTrial;
  trial.question.options.report = Report::kCount;
}

std::optional<RemoteError> Session::Impl::try_establish(WallClock::time_point deadline) {
  drop_trial_sent_again();
  // A daemon that was restarted may allow fewer calls on a connection. gRPC would queue a stream above that
  // number and report nothing.
  if (attached_.has_limits()) {
    v1::GetServerInfoResponse ignored;
    if (std::optional<RemoteError> error = connection_->server_info(ignored, id(), looking())) return error;
  }
  // The daemon repeats cached answers; the remaining frames follow.
  const auto begin_stream = [&] {
    sent_ = 0;
    partial_ = {};
    lost_.reset();
    writable_ = true;
    draining_ = false;
    share_memory();
    put_trial_before();
  };
  if (!recreate_) {
    const std::optional<RemoteError> error = attach(deadline);
    if (!error && attached_is_own()) {
      begin_stream();
      return std::nullopt;
    }
    if (error && error->reason != v1::ERROR_REASON_SESSION_NOT_FOUND) return error;
    // The copy is behind, or more than one answer was lost: the daemon caches only the last.
    recreate_ = !error;
  }
  stream_.reset();
  if (recreate_) {
    const std::optional<RemoteError> removed = connection_->remove(id(), looking());
    if (removed && removed->reason != v1::ERROR_REASON_SESSION_NOT_FOUND) return removed;
    recreate_ = false;
  }
  // Consecutive calls may reach different daemons: check the copy there in the next try.
  const auto elsewhere = [](const Error& error) {
    return RemoteError{error, v1::ERROR_REASON_STATE_CHANGED};
  };
  if (const std::optional<RemoteError> error = create())
    return error->reason == v1::ERROR_REASON_SESSION_EXISTS ? elsewhere(error->error) : *error;
  if (std::optional<RemoteError> error = attach(deadline)) return error;
  if (!attached_is_own() && !attached_as_created())
    return elsewhere({ErrorCode::kAborted, "session " + id() +
                                               " is not in the state that it was just created in: it is also "
                                               "used by another client, or calls reach different daemons"});
  begin_stream();
  return std::nullopt;
}

void Session::Impl::share_memory() {
  const std::optional<std::string> path = connection_->memory_socket();
  if (!path || !attached_.has_shared_memory()) return;
  room_ = wanted_room_;
  stream_->share(*path, id(), attached_.shared_memory().token(), memory_for(room_));
}

std::size_t Session::Impl::memory_for(std::size_t room) const {
  // Of the last frame's positions, the last trial's, and those under way; and their answers.
  constexpr std::size_t kMostFrames = 4, kLeastFrames = 2, kMostPositions = std::size_t{256} << 20;
  constexpr std::size_t kAnswers = 2;
  const std::size_t positions = SharedRegion::room_of(std::max<std::size_t>(state_.positions().size(), 1));
  const std::size_t frames = std::clamp(kMostPositions / positions, kLeastFrames, kMostFrames);
  return frames * positions + kAnswers * SharedRegion::room_of(room);
}

bool Session::Impl::attached_as_created() const {
  return !known_ && !attached_.has_state() && attached_.expected_frame() == header_.first_frame() + 1;
}

bool Session::Impl::attached_is_own() const {
  if (!known_ || !attached_.has_state()) return false;
  const v1::SessionState& state = attached_.state();
  if (same_state(state, *known_)) return true;
  if (!attached_.has_state_before() || !same_state(attached_.state_before(), *known_)) return false;
  // Ahead by one: by a frame, whose content the daemon compares when it is sent again, or by a change, whose
  // key it does. Not where a trial is due: it was not answered, and cannot be asked in the later state.
  return state.frame() == known_->frame() ? changing_
                                          : !unanswered_.empty() && unanswered_.front().counts() &&
                                                unanswered_.front().number == state.frame();
}

std::optional<RemoteError> Session::Impl::create() {
  state_.describe(header_);
  v1::CreateSessionResponse response;
  std::optional<RemoteError> error =
      connection_->create(header_, state_.scene(), state_.positions(), response, looking());
  // Until an answer comes the old state is kept: a copy created by a lost call is compared with it.
  if (!error)
    known_ = response.session().has_state() ? std::optional(response.session().state()) : std::nullopt;
  return error;
}

std::optional<RemoteError> Session::Impl::attach(WallClock::time_point deadline) {
  const RemoteError timeout{{ErrorCode::kUnavailable, "no daemon answers"}};
  // The session's own once it is attached.
  auto stream = std::make_unique<StepStream>(*connection_, id(), looking(), traceparent_);
  if (stream->start(deadline) != StepStream::Event::kDone) return timeout;
  v1::StreamStepsRequest request;
  request.mutable_attach()->set_session_id(id());
  // The daemon may not have noticed yet that the previous stream is dead.
  request.mutable_attach()->set_takeover(true);
  // Nor whether it was given up before this one: without this it could take over from it, coming late.
  request.mutable_attach()->set_client_id(client_id_);
  request.mutable_attach()->set_attempt(++attach_attempts_);
  const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(deadline - WallClock::now());
  const StepStream::Event written = stream->write(request, std::max(left, std::chrono::milliseconds(0)));
  if (written == StepStream::Event::kTimeout) return timeout;
  v1::StreamStepsResponse response;
  // Frames of the previous stream may still be in progress: the answer comes after them.
  const StepStream::Event read =
      stream->read(response, deadline_after(connection_->options().answer_timeout));
  if (read == StepStream::Event::kTimeout) return timeout;
  if (read == StepStream::Event::kDone || read == StepStream::Event::kEnded) stream_ = std::move(stream);
  if (read == StepStream::Event::kEnded) return ended();
  if (!response.has_attached()) return RemoteError{{ErrorCode::kUnavailable, "the daemon is draining"}};
  attached_ = std::move(*response.mutable_attached());
  const v1::Limits& limits = attached_.limits();
  window_ = std::max(limits.window(), 1u);
  chunk_bytes_ = std::clamp<std::size_t>(limits.max_message_bytes(), 2 * kMessageOverhead, kFrameChunk) -
                 kMessageOverhead;
  return std::nullopt;
}

}  // namespace warmfront::client

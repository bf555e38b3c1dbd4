// SPDX-License-Identifier: Apache-2.0
// Creating, attaching and resuming a session. Thread safety as stated in session_impl.h.
#include <algorithm>
#include <thread>
#include <utility>

#include "client/lib/session_impl.h"

namespace warmfront::client {
namespace {

using Clock = std::chrono::system_clock;

constexpr std::chrono::milliseconds kFirstBackoff{50};
constexpr std::chrono::milliseconds kLongestBackoff{2000};
/// One message of positions: large enough to be fast, small enough not to hold up other streams of the
/// connection.
constexpr std::size_t kFrameChunk = std::size_t{4} << 20;
/// What a message has besides its bulk field.
constexpr std::size_t kMessageOverhead = 1024;

}  // namespace

Error Session::Impl::fail(Error error) {
  if (!failed_) failed_ = std::move(error);
  stream_.reset();
  unanswered_.clear();
  return *failed_;
}

RemoteError Session::Impl::ended() {
  RemoteError remote = remote_error_from(stream_->finish(Clock::now() + connection_->options().call_timeout));
  // A stream ends with OK only after a detach, and none was sent.
  if (remote.error.message.empty())
    remote.error = {ErrorCode::kUnavailable, "the stream ended before its answers"};
  stream_.reset();
  return remote;
}

Status Session::Impl::open() {
  const std::optional<RemoteError> error = create();
  // With the connection lost it may have been created all the same: establish() finds out.
  if (error && !error->lost_session_or_daemon()) return fail(error->error);
  return establish();
}

Status Session::Impl::resume(const RemoteError& why) {
  stream_.reset();
  if (!why.lost_session_or_daemon()) return fail(why.error);
  if (resumes_without_answer_ >= connection_->options().max_resumes_without_answer)
    return fail({ErrorCode::kUnavailable, "gave up after " + std::to_string(resumes_without_answer_) +
                                              " resumes without an answer to frame " +
                                              std::to_string(unanswered_.front().number) + ": " +
                                              why.error.message});
  ++resumes_without_answer_;
  ++resumes_;
  if (connection_->options().on_lost) connection_->options().on_lost(why.error);
  return establish();
}

Status Session::Impl::establish() {
  const Clock::time_point deadline = Clock::now() + connection_->options().resume_timeout;
  for (std::chrono::milliseconds backoff = kFirstBackoff;; backoff = std::min(2 * backoff, kLongestBackoff)) {
    const std::optional<RemoteError> error = try_establish(deadline);
    if (!error) return {};
    stream_.reset();
    if (!error->lost_session_or_daemon()) return fail(error->error);
    if (Clock::now() + backoff >= deadline)
      return fail(
          {ErrorCode::kUnavailable,
           "session " + id() + " could not be resumed within the resume timeout: " + error->error.message});
    std::this_thread::sleep_for(backoff);
  }
}

std::optional<RemoteError> Session::Impl::try_establish(Clock::time_point deadline) {
  if (recreate_) {
    std::optional<RemoteError> removed = connection_->remove(id());
    if (removed && removed->reason != v1::ERROR_REASON_SESSION_NOT_FOUND) return removed;
    recreate_ = false;
  }
  std::optional<RemoteError> error = attach(deadline);
  const std::uint64_t due = header_.first_frame() + 1;
  if (!error && !(expected_ == due || (expected_ == due + 1 && !unanswered_.empty()))) {
    // Answers to more than one frame were lost, and the daemon keeps only the last: start over from what was
    // answered.
    stream_.reset();
    if (std::optional<RemoteError> removed = connection_->remove(id()))
      error = std::move(removed);
    else
      error = RemoteError{{}, v1::ERROR_REASON_SESSION_NOT_FOUND};
  }
  if (error && error->reason == v1::ERROR_REASON_SESSION_NOT_FOUND) {
    stream_.reset();
    error = create();
    if (error && error->reason != v1::ERROR_REASON_SESSION_EXISTS) return error;
    error = attach(deadline);
    if (!error && expected_ != due)
      return RemoteError{{ErrorCode::kAborted, "session " + id() + " is stepped by someone else as well"},
                         v1::ERROR_REASON_SESSION_ATTACHED};
  }
  if (error) return error;
  // What the daemon answered already comes again from its memory, and the rest follows.
  sent_ = 0;
  partial_ = {};
  writable_ = true;
  draining_ = false;
  return std::nullopt;
}

std::optional<RemoteError> Session::Impl::create() {
  state_.describe(header_);
  return connection_->create(header_, state_.scene(), state_.positions());
}

std::optional<RemoteError> Session::Impl::attach(Clock::time_point deadline) {
  const RemoteError timeout{{ErrorCode::kUnavailable, "no daemon answers"}};
  stream_ = std::make_unique<StepStream>(*connection_, id());
  if (stream_->start(deadline) != StepStream::Event::kDone) return timeout;
  v1::StreamStepsRequest request;
  request.mutable_attach()->set_session_id(id());
  // The stream before may not have been noticed to be dead yet.
  request.mutable_attach()->set_takeover(true);
  const StepStream::Event written = stream_->write(request, deadline);
  if (written == StepStream::Event::kTimeout) return timeout;
  v1::StreamStepsResponse response;
  // Frames of the stream before may still be computed: the answer comes after them.
  const StepStream::Event read =
      stream_->read(response, Clock::now() + connection_->options().answer_timeout);
  if (read == StepStream::Event::kTimeout) return timeout;
  if (read == StepStream::Event::kEnded) return ended();
  if (!response.has_attached()) return RemoteError{{ErrorCode::kUnavailable, "the daemon is draining"}};
  expected_ = response.attached().expected_frame();
  const v1::Limits& limits = response.attached().limits();
  window_ = std::max(limits.window(), 1u);
  chunk_bytes_ = std::clamp<std::size_t>(limits.max_message_bytes(), 2 * kMessageOverhead, kFrameChunk) -
                 kMessageOverhead;
  return std::nullopt;
}

}  // namespace warmfront::client

// SPDX-License-Identifier: Apache-2.0
// Frames and answers of a session. Resuming is in session_resume.cpp. Thread safety as stated in the header.
#include "client/lib/session_impl.h"

#include <utility>

namespace warmfront::client {
namespace {

std::string bytes_of(const Positions& positions) {
  return std::visit(
      [](auto span) { return std::string(reinterpret_cast<const char*>(span.data()), span.size_bytes()); },
      positions);
}

std::string name_of(std::uint64_t frame) {
  return "frame " + std::to_string(frame);
}

StepStream::Deadline after(std::chrono::milliseconds timeout) {
  return std::chrono::system_clock::now() + timeout;
}

}  // namespace

Session::Impl::Impl(std::shared_ptr<Connection> connection, v1::SessionHeader header, SceneDescription scene,
                    std::string positions)
    : connection_(std::move(connection)),
      scene_(std::move(scene)),
      header_(std::move(header)),
      last_positions_(std::move(positions)) {}

Session::Impl::~Impl() {
  static_cast<void>(close());
}

Result<std::uint64_t> Session::Impl::submit(const Positions& positions) {
  if (failed_) return *failed_;
  const bool float32 = std::holds_alternative<std::span<const float>>(positions);
  if (float32 != (header_.dtype() == v1::DTYPE_FLOAT32))
    return invalid_argument(std::string("positions: the session was created with ") +
                            (float32 ? "float64" : "float32") + " positions; give every frame the same kind");
  const std::uint64_t number = header_.first_frame() + 1 + unanswered_.size();
  const std::size_t count = std::visit([](auto span) { return span.size(); }, positions);
  if (count != std::size_t{3} * header_.vertex_count())
    return invalid_argument(name_of(number) + ": positions: " + std::to_string(count) + " numbers, but 3 x " +
                            std::to_string(header_.vertex_count()) + " are expected");
  if (frame_failed_)
    return Error{ErrorCode::kFailedPrecondition,
                 "a frame failed, and frames were sent after it; take their answers before sending more"};
  if (unanswered_.size() >= window_)
    return Error{ErrorCode::kFailedPrecondition,
                 std::to_string(window_) +
                     " frames are unanswered, which is the daemon's window; take an "
                     "answer before sending more"};
  unanswered_.push_back({number, bytes_of(positions)});
  send_frames();
  return number;
}

void Session::Impl::send_frames() {
  while (writable_ && sent_ < unanswered_.size() && sent_ < window_) {
    if (!send_frame(unanswered_[sent_])) {
      writable_ = false;
      return;
    }
    ++sent_;
  }
}

bool Session::Impl::send_frame(const Frame& frame) {
  v1::StreamStepsRequest request;
  v1::StepFrame& step = *request.mutable_step();
  step.set_frame(frame.number);
  std::size_t at = 0;
  do {
    step.set_positions(frame.positions.substr(at, chunk_bytes_));
    at += chunk_bytes_;
    step.set_more(at < frame.positions.size());
    if (stream_->write(request, after(connection_->options().answer_timeout)) != StepStream::Event::kDone)
      return false;
  } while (step.more());
  return true;
}

Result<Answer> Session::Impl::next_answer() {
  if (failed_) return *failed_;
  if (unanswered_.empty())
    return Error{ErrorCode::kFailedPrecondition, "no frame is unanswered; submit one first"};
  for (;;) {
    send_frames();
    RemoteError lost{{ErrorCode::kUnavailable, "the daemon is draining"}};
    if (!(draining_ && sent_ == 0)) {
      v1::StreamStepsResponse response;
      const StepStream::Event event = stream_->read(response, after(connection_->options().answer_timeout));
      if (event == StepStream::Event::kDone) {
        std::optional<Result<Answer>> result = take(response);
        if (result) return *std::move(result);
        continue;
      }
      lost = event == StepStream::Event::kEnded
                 ? ended()
                 : RemoteError{{ErrorCode::kDeadlineExceeded, name_of(unanswered_.front().number) +
                                                                  ": no answer within the answer timeout"}};
    }
    if (const Status resumed = resume(lost); !resumed) return resumed.error();
  }
}

std::optional<Result<Answer>> Session::Impl::take(v1::StreamStepsResponse& response) {
  switch (response.message_case()) {
    case v1::StreamStepsResponse::kAnswer:
      return take_answer(response.answer());
    case v1::StreamStepsResponse::kError: {
      // Dropped sessions end the stream too: it is read to its end, and resumed.
      if (remote_error_from(response.error().status()).reason == v1::ERROR_REASON_SESSION_NOT_FOUND)
        return std::nullopt;
      return take_error(response.error());
    }
    case v1::StreamStepsResponse::kDraining:
      draining_ = true;
      writable_ = false;
      return std::nullopt;
    default:
      return fail({ErrorCode::kInternal, "the daemon sent a message that is out of place"});
  }
}

std::optional<Result<Answer>> Session::Impl::take_answer(const v1::StepAnswer& part) {
  Frame& frame = unanswered_.front();
  if (part.frame() != frame.number)
    return fail({ErrorCode::kInternal, "the daemon answered " + name_of(part.frame()) + " where " +
                                           name_of(frame.number) + " is due"});
  if (const Status appended = append_columns(part.contacts(), partial_.contacts); !appended)
    return fail(appended.error());
  if (!part.last()) return std::nullopt;
  if (const Status finished = finish_answer(part, partial_); !finished) return fail(finished.error());
  header_.set_first_frame(frame.number);
  last_positions_ = std::move(frame.positions);
  unanswered_.pop_front();
  --sent_;
  resumes_without_answer_ = 0;
  return std::exchange(partial_, {});
}

Result<Answer> Session::Impl::take_error(const v1::StepError& message) {
  const RemoteError remote = remote_error_from(message.status());
  if (message.frame() != unanswered_.front().number)
    return fail({ErrorCode::kInternal, "the daemon refused " + name_of(message.frame()) + " where " +
                                           name_of(unanswered_.front().number) +
                                           " is due: " + remote.error.message});
  // The engine broke on this very frame and the session is gone: creating it again would end the same way.
  if (remote.reason == v1::ERROR_REASON_ENGINE) return fail(remote.error);
  unanswered_.pop_front();
  --sent_;
  resumes_without_answer_ = 0;
  frame_failed_ = !unanswered_.empty();
  return remote.error;
}

Status Session::Impl::close() {
  if (failed_) return *failed_;
  failed_ = Error{ErrorCode::kFailedPrecondition, "the session is closed"};
  stream_.reset();
  unanswered_.clear();
  const std::optional<RemoteError> error = connection_->remove(id());
  // Gone is gone.
  if (error && error->reason != v1::ERROR_REASON_SESSION_NOT_FOUND) return error->error;
  return {};
}

}  // namespace warmfront::client

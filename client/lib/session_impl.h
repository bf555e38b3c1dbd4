// SPDX-License-Identifier: Apache-2.0
// What a Session does: frames out, answers in, and resuming. Used by one thread at a time.
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "client/lib/client.h"
#include "client/lib/connection.h"
#include "client/lib/scene_state.h"
#include "client/lib/step_stream.h"

namespace warmfront::client {

/// Everything needed to create the session again is kept here: the scene, the positions last answered, the
/// frames unanswered. A frame leaves `unanswered_` only when its answer is complete, so each gets exactly
/// one.
struct Session::Impl {
  Impl(std::shared_ptr<Connection> connection, v1::SessionHeader header, SceneState state);
  ~Impl();

  /// Creates the session in the daemon and attaches to it.
  Status open();
  Result<std::uint64_t> submit(const Frame& frame);
  Result<std::uint32_t> add_body(BodyAddition addition, const Positions& positions);
  Status change_body(std::uint32_t index, Body body);
  Result<Answer> next_answer();
  Status close();

  const std::string& id() const { return header_.session_id(); }
  std::uint32_t window() const { return window_; }
  std::uint64_t resumes() const { return resumes_; }
  bool idle() const { return unanswered_.empty(); }

 private:
  /// Attaches, creating the session anew where it is unknown or too far ahead; tries until the resume
  /// timeout.
  Status establish();
  std::optional<RemoteError> try_establish(StepStream::Deadline deadline);
  std::optional<RemoteError> create();
  /// Leaves the frame that the daemon expects in `expected_`.
  std::optional<RemoteError> attach(StepStream::Deadline deadline);

  /// Resumes after the stream was lost, or fails for good.
  Status resume(const RemoteError& why);
  Error fail(Error error);

  /// Sends what may be sent. A stream that cannot be written to may still have answers: it is read to its end
  /// first.
  void send_frames();
  bool send_frame(SentFrame& frame);
  /// Has the daemon carry out a change, after which `taken` holds. When the daemon is lost on the way, the
  /// session is created again with the change made.
  Status change(v1::SceneChange change, const std::function<void()>& taken);
  /// The frame's answer or error when the message completes one.
  std::optional<Result<Answer>> take(v1::StreamStepsResponse& response);
  std::optional<Result<Answer>> take_answer(const v1::StepAnswer& part);
  Result<Answer> take_error(const v1::StepError& message);
  /// How the stream ended; it is gone afterwards.
  RemoteError ended();

  // Constant after construction.
  const std::shared_ptr<Connection> connection_;

  v1::SessionHeader header_;  ///< first_frame: the frame last answered
  SceneState state_;          ///< at that frame
  std::deque<SentFrame> unanswered_;
  std::size_t sent_ = 0;       ///< of these, on the present stream
  bool frame_failed_ = false;  ///< and answers to frames after it are outstanding
  Answer partial_;             ///< the chunks so far of the oldest unanswered frame

  std::unique_ptr<StepStream> stream_;
  std::uint64_t expected_ = 0;
  std::uint32_t window_ = 1;
  std::size_t chunk_bytes_ = 0;  ///< of positions in one message
  bool writable_ = false;        ///< the stream takes frames: it neither broke nor drains
  bool draining_ = false;
  bool recreate_ = false;  ///< what the daemon has may not be this scene

  std::uint64_t resumes_ = 0;
  int resumes_without_answer_ = 0;
  std::optional<Error> failed_;  ///< for good
};

}  // namespace warmfront::client

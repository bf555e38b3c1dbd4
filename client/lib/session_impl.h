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
  /// A limit of the daemon that others fill: is room waited for?
  enum class Full { kFails, kWaits };
  /// Attaches to the session where it is in this session's state, else creates it again; tries until the
  /// resume timeout.
  Status establish(Full full);
  std::optional<RemoteError> try_establish(StepStream::Deadline deadline);
  /// Leaves the state that it was created in in `known_`.
  std::optional<RemoteError> create();
  /// Leaves what the daemon says in `attached_`.
  std::optional<RemoteError> attach(StepStream::Deadline deadline);
  /// Whether what is attached to is in the state `known_`, or ahead of it by what was sent and not answered.
  bool attached_is_own() const;
  /// The copy in the daemon was made by this call, and states nothing of itself.
  bool attached_as_created() const;

  /// Resumes after the stream was lost, or fails for good.
  Status resume(const RemoteError& why);
  Error fail(Error error);

  /// Sends what may be sent. A stream that cannot be written to may still have answers: it is read to its end
  /// first.
  void send_frames();
  bool send_frame(SentFrame& frame);
  /// Has the daemon carry out a change, after which `taken` holds. When the daemon is lost on the way, the
  /// session is resumed as it was before the change, which is sent again: it is carried out once.
  Status change(v1::SceneChange change, const std::function<void()>& taken);
  /// The frame's answer or error when the message completes one.
  std::optional<Result<Answer>> take(v1::StreamStepsResponse& response);
  std::optional<Result<Answer>> take_answer(const v1::StepAnswer& part);
  Result<Answer> take_error(const v1::StepError& message);
  /// How the stream ended; it is gone afterwards.
  RemoteError ended();

  // Constant after construction.
  const std::shared_ptr<Connection> connection_;

  v1::SessionHeader header_;  ///< first_frame: the frame last answered; first_revision: changes made
  SceneState state_;          ///< at that frame
  std::deque<SentFrame> unanswered_;
  std::size_t sent_ = 0;       ///< of these, on the present stream
  bool frame_failed_ = false;  ///< and answers to frames after it are outstanding
  Answer partial_;             ///< the chunks so far of the oldest unanswered frame

  /// What the daemon said last of the state that the session is in: with `state_`, what it is. None where a
  /// daemon says nothing of it, being older than that.
  std::optional<v1::SessionState> known_;

  std::unique_ptr<StepStream> stream_;
  std::optional<RemoteError> lost_;  ///< why the stream is not to be read any further
  v1::Attached attached_;
  std::uint32_t window_ = 1;
  std::size_t chunk_bytes_ = 0;  ///< of positions in one message
  bool writable_ = false;        ///< the stream takes frames: it neither broke nor drains
  bool draining_ = false;
  bool recreate_ = false;  ///< what the daemon has is not this session
  bool changing_ = false;  ///< a change was sent and is not answered

  std::uint64_t resumes_ = 0;
  int resumes_without_answer_ = 0;
  std::optional<Error> failed_;  ///< for good
};

}  // namespace warmfront::client

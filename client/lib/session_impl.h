// SPDX-License-Identifier: Apache-2.0
// A Session's implementation: sending frames, taking answers, and resuming. Used by one thread at a time.
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "client/lib/client.h"
#include "client/lib/connection.h"
#include "client/lib/scene_state.h"
#include "client/lib/step_stream.h"

namespace warmfront::client {

/// Keeps everything needed to create the session again: the scene, the last answered positions, the
/// unanswered frames. A frame leaves `unanswered_` only when its answer is complete, so each gets exactly
/// one.
struct Session::Impl {
  Impl(std::shared_ptr<Connection> connection, v1::SessionHeader header, SceneState state);
  ~Impl();

  /// Creates the session in the daemon and attaches to it.
  Status open();
  Result<std::uint64_t> submit(const Frame& frame, const Question& question);
  Result<std::uint64_t> submit_commit(double fraction);
  /// submit(), and the answer.
  Result<Answer> ask(const Frame& frame, const Question& question);
  /// kFailedPrecondition while frames are unanswered.
  Status check_idle() const;
  Result<std::uint32_t> add_body(BodyAddition addition, const Positions& positions);
  Status change_body(std::uint32_t index, Body body);
  Status change_filters(PairFilters filters);
  Result<Answer> next_answer();
  Status close();

  const std::string& id() const { return header_.session_id(); }
  std::uint32_t window() const { return window_; }
  std::uint64_t resumes() const { return resumes_; }

 private:
  /// kUnimplemented where the daemon lacks the feature; the session's failure where it has failed.
  Status need(v1::Feature feature);
  /// The number of the next frame.
  std::uint64_t next_number() const;
  Result<std::uint64_t> send(SentFrame frame);
  /// A trial that was answered, before the commit that is due, where the daemon does not know it.
  void put_trial_before();
  void drop_trial_sent_again();

  /// A limit of the daemon that others fill: is room waited for?
  enum class Full { kFails, kWaits };
  /// Attaches to the session if the daemon's copy is in this session's state, else creates it again; retries
  /// until the resume timeout.
  Status establish(Full full);
  std::optional<RemoteError> try_establish(StepStream::Deadline deadline);
  /// Stores the created state in `known_`.
  std::optional<RemoteError> create();
  /// Stores the daemon's statement in `attached_`.
  std::optional<RemoteError> attach(StepStream::Deadline deadline);
  /// Is the attached copy in the state `known_`, or ahead of it by unanswered requests?
  bool attached_is_own() const;
  /// The daemon's copy was created by this call, and the daemon does not report its state.
  bool attached_as_created() const;

  /// Resumes after the stream was lost, or fails for good.
  Status resume(const RemoteError& why);
  Error fail(Error error);

  /// Sends frames as far as the window allows. If writing fails, answers may still arrive: the stream is read
  /// to its end first.
  void send_frames();
  bool send_frame(SentFrame& frame);
  /// Has the daemon carry out a change, then calls `taken`. If the daemon is lost, the session is resumed in
  /// the state before the change, which is sent again with its key: it is carried out once.
  Status change(v1::SceneChange change, const std::function<void()>& taken);
  /// The frame's answer or error when the message completes one.
  std::optional<Result<Answer>> take(v1::StreamStepsResponse& response);
  std::optional<Result<Answer>> take_answer(const v1::StepAnswer& part);
  std::optional<Result<Answer>> take_error(const v1::StepError& message);
  /// How the stream ended; it is gone afterwards.
  RemoteError ended();

  // Constant after construction.
  const std::shared_ptr<Connection> connection_;

  v1::SessionHeader header_;  ///< first_frame: the last answered frame; first_revision: changes made
  SceneState state_;          ///< at that frame
  std::deque<SentFrame> unanswered_;
  /// The last question, where it was a trial that was answered: what a commit is of.
  struct Trial {
    SentFrame frame;
    // Of its answer, as much as a commit tells of it.
    std::vector<ContactKind> kind;
    std::vector<ContactStatus> status;
    std::vector<double> toi;
    std::uint64_t vf = 0;
    std::uint64_t ee = 0;
    std::uint64_t possible = 0;
    std::optional<double> earliest_toi;

    /// As Collider::commit() has it.
    CommitResult up_to(double fraction) const;
  };
  std::optional<Trial> last_trial_;
  bool may_commit_ = false;    ///< what was submitted last was a trial, and is answered or on its way
  std::size_t sent_ = 0;       ///< of these, on the present stream
  bool frame_failed_ = false;  ///< and answers to frames after it are outstanding
  Answer partial_;             ///< the chunks so far of the oldest unanswered frame

  /// The session's state as the daemon last reported it; with `state_`, its whole identity. None if the
  /// daemon is too old to report it.
  std::optional<v1::SessionState> known_;

  std::unique_ptr<StepStream> stream_;
  std::optional<RemoteError> lost_;  ///< why the stream must not be read further
  v1::Attached attached_;
  std::uint32_t window_ = 1;
  std::size_t chunk_bytes_ = 0;  ///< of positions in one message
  bool writable_ = false;        ///< the stream accepts frames: neither broken nor draining
  bool draining_ = false;
  bool recreate_ = false;  ///< the daemon's copy is not this session
  bool changing_ = false;  ///< a change was sent and is not yet answered

  std::uint64_t resumes_ = 0;
  int resumes_without_answer_ = 0;
  std::optional<Error> failed_;  ///< permanent
};

}  // namespace warmfront::client

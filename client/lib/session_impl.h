// SPDX-License-Identifier: Apache-2.0
// A Session's implementation: sending frames, taking answers, changing the scene, and resuming. Used by one
// thread at a time.
#pragma once

#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "client/lib/client.h"
#include "client/lib/connection.h"
#include "client/lib/frame_writer.h"
#include "client/lib/last_trial.h"
#include "client/lib/pending.h"
#include "client/lib/refused_frame.h"
#include "client/lib/scene_changes.h"
#include "client/lib/scene_state.h"
#include "client/lib/step_stream.h"
#include "client/lib/uuid.h"

namespace warmfront::client {

/// Keeps everything needed to create the session again: the scene, the last answered positions, the
/// unanswered frames. A frame leaves `unanswered_` only when its answer is complete, so each gets exactly
/// one.
struct Session::Impl : std::enable_shared_from_this<Session::Impl> {
  /// `traceparent`: of its frames; empty: the connection's.
  Impl(std::shared_ptr<Connection> connection, v1::SessionHeader header, SceneState state,
       std::string traceparent);
  ~Impl();

  /// Creates the session in the daemon and attaches to it.
  Status open();
  /// For next_answer() to take the answers of, in this order.
  Result<std::uint64_t> submit(const Frame& frame, const Question& question);
  Result<std::uint64_t> submit_commit(double fraction);
  /// Each sends what may be sent and does not wait. What fails at once is a settled answer.
  /// `handed_out`: as PendingAnswer has it.
  std::shared_ptr<PendingAnswer> ask(const Frame& frame, const Question& question, const WaitOptions& wait,
                                     bool handed_out);
  std::shared_ptr<PendingAnswer> ask_commit(double fraction, const WaitOptions& wait, bool handed_out);
  /// Takes answers until this one is settled, or until then.
  void wait(PendingAnswer& asked, PendingAnswer::Time until);
  /// Has the daemon carry out the change, exactly once, and keeps what it makes of the scene.
  Status change(SceneEdit edit);
  Status change(std::vector<SceneChange> changes, const std::optional<ColliderOptions>& options);
  Status change_options(const ColliderOptions& options);
  Result<Answer> next_answer();
  Result<std::vector<double>> positions() const;
  Result<std::vector<BodyPose>> poses() const;
  Status close();

  std::uint32_t body_count() const { return static_cast<std::uint32_t>(state_.scene().bodies.size()); }
  const std::string& id() const { return header_.session_id(); }
  std::uint32_t window() const { return window_; }
  std::uint64_t resumes() const { return resumes_; }
  bool shares_memory() const { return stream_ && stream_->region() != nullptr; }

 private:
  static constexpr std::size_t kLeastRoom = std::size_t{1} << 16;

  class Asked;
  /// Thrown by look(): the oldest question is to be given up, ...
  struct GivenUp {
    Error why;
  };
  /// ... or nobody waits any longer.
  struct WaitedEnough {};

  // Waiting (session_impl.cpp).
  /// May anything be waited for any longer? As a Look.
  StepStream::Deadline look();
  Look looking() {
    return [this] { return look(); };
  }
  void sleep(std::chrono::milliseconds time);
  /// Takes the next message, or resumes.
  void advance();
  void drop_stream();

  // What is asked (session_questions.cpp).
  std::shared_ptr<PendingAnswer> asked(const WaitOptions& wait, bool handed_out);
  /// kFailedPrecondition when the window is full.
  Status check_may_submit() const;
  /// kFailedPrecondition while answers to what was submitted are not taken; as PendingAnswer::check().
  Status check_may_ask(const WaitOptions& wait) const;
  Result<std::uint64_t> encode_and_send(const Frame& frame, const Question& question,
                                        std::shared_ptr<PendingAnswer> asked);
  /// Where the daemon is to wait for nothing else, tells it of the frame before its positions are written.
  void begin_frame(const Frame& frame, const Question& question);
  Result<std::uint64_t> send_commit(double fraction, std::shared_ptr<PendingAnswer> asked);
  Result<std::uint64_t> send(SentFrame frame);
  /// The number of the next frame.
  std::uint64_t next_number() const;
  /// Where answers turned out longer than their room, more memory is asked for between two frames.
  void enlarge_rooms();
  /// Sends frames as far as the window allows. If writing fails, answers may still arrive: the stream is read
  /// to its end first.
  void send_frames();
  FrameWriter writer();

  // What is answered (session_answers.cpp).
  /// Settles the oldest question when the message completes its answer.
  void take(v1::StreamStepsResponse& response);
  void take_answer(const v1::StepAnswer& part);
  void take_error(const v1::StepError& message);
  /// Of the oldest question.
  void settle_refused(Error error);
  /// The oldest question, which the daemon may have answered already, does not count. The stream is dropped,
  /// at which the daemon stops; the next one begins where this session is.
  void give_up(const Error& why);

  // Changes (session_changes.cpp).
  /// kFailedPrecondition while answers are to be taken: before a change of the scene.
  Status check_idle() const;
  /// kUnimplemented where the daemon lacks the feature; the session's failure where it has failed.
  Status need(v1::Feature feature);
  /// Has the daemon carry out the request's changes. If the daemon is lost, the session is resumed in the
  /// state before them, and they are sent again with their key: they are carried out once.
  Status carry_out(v1::ChangeSceneRequest& request);

  // Creating, attaching and resuming (session_resume.cpp).
  /// A limit of the daemon that others fill: is room waited for?
  enum class Full { kFails, kWaits };
  /// Waits for one until the resume timeout.
  Status find_daemon();
  /// Attaches to the session if the daemon's copy is in this session's state, else creates it again; retries
  /// until the resume timeout.
  Status establish(Full full);
  std::optional<RemoteError> try_establish(StepStream::Deadline deadline);
  /// Stores the created state in `known_`.
  std::optional<RemoteError> create();
  /// Stores the daemon's statement in `attached_`.
  std::optional<RemoteError> attach(StepStream::Deadline deadline);
  /// Has messages go by packets, and memory shared, where the daemon offers it.
  void share_memory();
  /// Of the session's positions, and of answers with so much room each.
  std::size_t memory_for(std::size_t room) const;
  /// Is the attached copy in the state `known_`, or ahead of it by unanswered requests?
  bool attached_is_own() const;
  /// The daemon's copy was created by this call, and the daemon does not report its state.
  bool attached_as_created() const;
  /// A trial that was answered, before the commit that is due, where the daemon does not know it.
  void put_trial_before();
  void drop_trial_sent_again();
  /// Resumes after the stream was lost, or fails for good.
  Status resume(const RemoteError& why);
  Error fail(Error error);
  /// Of a session that was not made, or resumed, within the resume timeout; `why` is the last try's.
  Error not_in_time(const char* done, const Error& why, const char* ended) const;
  void end_with(Error error) { static_cast<void>(fail(std::move(error))); }
  /// How the stream ended; it is gone afterwards.
  RemoteError ended();

  // Constant after construction.
  const std::shared_ptr<Connection> connection_;
  const std::string traceparent_;

  // What is kept to create the session again.
  v1::SessionHeader header_;  ///< first_frame: the last answered frame; first_revision: changes made
  SceneState state_;          ///< at that frame
  /// The session's state as the daemon last reported it; with `state_`, its whole identity. None if the
  /// daemon is too old to report it.
  std::optional<v1::SessionState> known_;

  // What is unanswered.
  std::deque<SentFrame> unanswered_;
  std::deque<std::shared_ptr<PendingAnswer>> submitted_;  ///< what next_answer() takes
  Answer partial_;             ///< the chunks so far of the oldest unanswered frame
  bool frame_failed_ = false;  ///< and answers to frames after it are outstanding
  bool changing_ = false;      ///< a change was sent and is not yet answered
  RefusedFrame refused_;       ///< before it was sent
  PendingAnswer::Time until_ = PendingAnswer::Time::max();  ///< how long wait() waits

  // What may be committed.
  std::optional<LastTrial> last_trial_;  ///< the last question, where it was a trial that was answered
  bool may_commit_ = false;  ///< what was submitted last was a trial, and is answered or on its way

  // The stream to the daemon.
  std::unique_ptr<StepStream> stream_;
  const std::string client_id_ = random_uuid();  ///< of this object: orders its streams
  std::uint64_t attach_attempts_ = 0;
  std::optional<RemoteError> lost_;  ///< why the stream must not be read further
  v1::Attached attached_;
  std::uint32_t window_ = 1;
  std::size_t chunk_bytes_ = 0;           ///< of positions in one message
  std::size_t wanted_room_ = kLeastRoom;  ///< for an answer, in memory that the daemon shares
  std::size_t room_ = kLeastRoom;         ///< that there is for each
  std::size_t sent_ = 0;                  ///< of the unanswered frames, on this stream
  bool writable_ = false;                 ///< the stream accepts frames: neither broken nor draining
  bool draining_ = false;
  bool recreate_ = false;  ///< the daemon's copy is not this session

  std::uint64_t resumes_ = 0;
  int resumes_without_answer_ = 0;
  std::optional<Error> failed_;  ///< permanent
};

}  // namespace warmfront::client

// SPDX-License-Identifier: Apache-2.0
// One StreamSteps call, from attach to end. Thread-safe.
#pragma once

#include <grpcpp/server_context.h>
#include <grpcpp/support/byte_buffer.h>
#include <grpcpp/support/server_callback.h>

#include <atomic>
#include <chrono>
#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <variant>

#include "server/annotations.h"
#include "server/process/lifecycle.h"
#include "server/session/session.h"
#include "server/transport/context.h"
#include "server/transport/frame_assembly.h"
#include "server/transport/reaction.h"
#include "server/transport/session_recording.h"
#include "server/transport/stream_codec.h"
#include "server/transport/stream_state.h"
#include "warmfront/v1/step.pb.h"

namespace warmfront::server {

/// Translates between gRPC and the session on one hand and the call's state (stream_state.h), which says what
/// is to be done, on the other. At most one read and one write are outstanding. A frame is begun to be read
/// only while fewer than `window` frames are in flight and the answers that wait hold less than
/// `max_queued_bytes`; a frame is in flight until the last chunk of its answer, encoded when its turn comes,
/// is written. So a client that does not read is not read from, costs what the answers of a window hold, and
/// is cut off after `write_stall_timeout`. When the call ends, by cancellation or a lost connection too,
/// frames that wait or are being computed are given up; the session is at the last one completed.
class StepStream final : public grpc::ServerBidiReactor<grpc::ByteBuffer, grpc::ByteBuffer>,
                         public Drainable,
                         public std::enable_shared_from_this<StepStream> {
 public:
  /// Lives until gRPC calls OnDone(). `context` outlives it.
  static StepStream* start(Context& context, grpc::CallbackServerContext& call);

  void OnReadDone(bool ok) override;
  void OnWriteDone(bool ok) override;
  void OnCancel() override;
  void OnDone() override;

  void notify_draining(std::chrono::system_clock::time_point deadline) override;
  void end(const Fault& fault) override;
  void end_if_quiet(const Fault& fault, std::chrono::milliseconds quiet) override;
  void enforce_timeouts(std::chrono::steady_clock::time_point now) override;
  void enforce_rights() override;
  void give_up(const Fault& fault) override;

 private:
  using Clock = std::chrono::steady_clock;

  class Reply;
  /// What the stream holds, if it has attached.
  struct Held {
    std::shared_ptr<Session> session;
    std::optional<Session::Attachment> attachment;
  };
  /// What is to be written: a message, or an answer's chunks one after the other.
  struct Outgoing {
    std::variant<grpc::ByteBuffer, AnswerChunks> what;
    bool ends_frame;
    std::unique_ptr<FrameTrace> trace = nullptr;  // of the frame, where it is traced
  };

  StepStream(Context& context, grpc::CallbackServerContext& call);

  void begin();

  // What a message asks for (step_stream_requests.cpp). Called for one at a time, without the lock.
  void handle(const StreamRequest& request);
  void attach(const v1::Attach& request);
  void take(const StreamRequest& request);
  void commit(const v1::Commit& request);
  void half_closed();
  Held held();
  std::unique_ptr<FrameTrace> trace_of(std::uint64_t frame) noexcept;
  std::unique_ptr<FrameObserver> reply_to(std::uint64_t frame, FrameRecord record,
                                          std::unique_ptr<FrameTrace> trace);

  // Replies, from any thread, without the lock.
  void attached(const Outcome<Standing>& standing);
  void answered(std::uint64_t frame, const FrameOutcome& outcome, std::unique_ptr<FrameTrace> trace);

  /// What is thrown in `work`, a reaction or a reply, ends the stream, and nothing more is delivered.
  template <class Work>
  void guarded(Work work) noexcept {
    react(std::move(work), [this](grpc::Status status) { fail(std::move(status)); });
  }
  /// The same of a message that is handled.
  template <class Work>
  void handling(Work work) noexcept {
    react(std::move(work),
          [this](grpc::Status status) { fail(std::move(status), StreamEvent::Kind::kHandlingFailed); });
  }
  void handle_read(bool ok);
  void fail(grpc::Status status, StreamEvent::Kind how = StreamEvent::Kind::kFailed) noexcept;

  // With the lock held.
  void end_locked(grpc::Status status) WARMFRONT_REQUIRES(mutex_);
  /// Nothing more can be delivered: what waits is dropped and given up.
  void break_locked(StreamEvent::Kind kind) WARMFRONT_REQUIRES(mutex_);
  void cut_off_locked() WARMFRONT_REQUIRES(mutex_);
  void write_locked() WARMFRONT_REQUIRES(mutex_);
  void queue_locked(Outgoing outgoing) WARMFRONT_REQUIRES(mutex_);
  void finish_locked() WARMFRONT_REQUIRES(mutex_);
  void release_locked() WARMFRONT_REQUIRES(mutex_);
  void log_end_locked(const grpc::Status& status) WARMFRONT_REQUIRES(mutex_);
  void happened_locked(StreamEvent::Kind kind, std::size_t bytes = 0) WARMFRONT_REQUIRES(mutex_);
  /// Does what is due.
  void advance_locked() WARMFRONT_REQUIRES(mutex_);

  // Constant after construction.
  Context& context_;
  grpc::CallbackServerContext& rpc_;
  const std::string metadata_id_;
  const std::optional<TraceContext> caller_trace_;
  const std::shared_ptr<std::atomic<bool>> given_up_ = std::make_shared<std::atomic<bool>>(false);

  // Set by start() before others see the stream, then constant.
  Principal principal_;
  std::shared_ptr<Tenant> tenant_;

  // Used by start() and OnDone() only: keeps the stream alive in between.
  std::shared_ptr<StepStream> self_;
  std::optional<Lifecycle::Call> call_;
  std::optional<Gate::Ticket> ticket_;

  // Used by the one outstanding read and OnReadDone() only.
  grpc::ByteBuffer incoming_;
  std::optional<FrameAssembly> assembly_;
  std::unique_ptr<FrameTrace> assembly_trace_;

  // Protected by mutex_.
  Mutex mutex_;
  std::shared_ptr<Session> session_ WARMFRONT_GUARDED_BY(mutex_);
  std::optional<Session::Attachment> attachment_ WARMFRONT_GUARDED_BY(mutex_);
  StreamState state_ WARMFRONT_GUARDED_BY(mutex_);
  grpc::ByteBuffer current_ WARMFRONT_GUARDED_BY(mutex_);  // must outlive its write
  Holding current_bytes_ WARMFRONT_GUARDED_BY(mutex_);     // of it, on the session's account
  Clock::time_point write_began_ WARMFRONT_GUARDED_BY(mutex_);
  std::unique_ptr<FrameTrace> ending_trace_ WARMFRONT_GUARDED_BY(mutex_);  // of the frame that current_ ends
  std::deque<Outgoing> writes_ WARMFRONT_GUARDED_BY(mutex_);
  Clock::time_point last_moved_ WARMFRONT_GUARDED_BY(mutex_) = Clock::now();  // a message, either way
  // For the message that attaches, or for the rest of a frame; stale when neither is owed.
  Clock::time_point awaited_since_ WARMFRONT_GUARDED_BY(mutex_) = last_moved_;
  std::optional<grpc::Status> end_ WARMFRONT_GUARDED_BY(mutex_);  // what the call is to be finished with
};

}  // namespace warmfront::server

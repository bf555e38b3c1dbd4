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
#include "server/transport/stream_memory.h"
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
///
/// Bound to a connection of packets (stream_memory.h), its messages come and go there, and a read of gRPC's
/// stays outstanding beside, for the end of the call: what comes by it before its turn waits. A connection
/// that is lost leaves the stream as it was before.
class StepStream final : public grpc::ServerBidiReactor<grpc::ByteBuffer, grpc::ByteBuffer>,
                         public Drainable,
                         public SharesMemory,
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

  bool bind(const std::shared_ptr<PacketConnection>& connection,
            const v1::SharedMemoryRequest& request) override;
  bool packet(const std::shared_ptr<PacketConnection>& from, std::string_view packet) noexcept override;
  void has_room(const std::shared_ptr<PacketConnection>& on) noexcept override;
  void lost(const std::shared_ptr<PacketConnection>& which) noexcept override;

 private:
  using Clock = std::chrono::steady_clock;

  class Reply;
  /// Where a message came.
  enum class Way : std::uint8_t { kStream, kPacket };
  /// A read of gRPC's.
  enum class Read : std::uint8_t {
    kNone,
    kOutstanding,
    kMessageWaits,  ///< it came before its turn
    kEndWaits,
  };
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
  void handle(StreamRequest& request, Way way);
  void attach(const v1::Attach& request);
  void take(StreamRequest& request, Way way);
  void commit(const v1::Commit& request);
  void half_closed();
  Held held();
  std::unique_ptr<FrameTrace> trace_of(std::uint64_t frame) noexcept;
  std::unique_ptr<FrameObserver> reply_to(std::uint64_t frame, FrameRecord record,
                                          std::unique_ptr<FrameTrace> trace, AnswerRoom room = {});
  /// What a frame says of shared memory (step_stream_memory.cpp): its positions, or what moved, are where they
  /// are there, for as long as `memory` is held, and the room for its answer. INVALID_ARGUMENT where it may not
  /// say so.
  Outcome<AnswerRoom> take_shared(StreamRequest& request, std::shared_ptr<StreamMemory>& memory);
  void give_memory(const v1::SharedMemoryRequest& request);

  // Replies, from any thread, without the lock.
  void attached(const Outcome<Standing>& standing);
  void answered(std::uint64_t frame, const FrameOutcome& outcome, AnswerRoom room,
                std::unique_ptr<FrameTrace> trace);

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
  void handle_message(grpc::ByteBuffer& message, Way way);
  void fail(grpc::Status status, StreamEvent::Kind how = StreamEvent::Kind::kFailed) noexcept;

  // With the lock held.
  void end_locked(grpc::Status status) WARMFRONT_REQUIRES(mutex_);
  /// Nothing more can be delivered: what waits is dropped and given up.
  void break_locked(StreamEvent::Kind kind) WARMFRONT_REQUIRES(mutex_);
  void cut_off_locked() WARMFRONT_REQUIRES(mutex_);
  void write_locked() WARMFRONT_REQUIRES(mutex_);
  /// What was encoded, by a packet or gRPC.
  void send_locked() WARMFRONT_REQUIRES(mutex_);
  void written_locked() WARMFRONT_REQUIRES(mutex_);
  void begin_read_locked() WARMFRONT_REQUIRES(mutex_);
  /// What waits is handled.
  void take_waiting_locked() WARMFRONT_REQUIRES(mutex_);
  void unbind_locked() WARMFRONT_REQUIRES(mutex_);
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
  const bool may_share_memory_;  // read while the call lives for certain
  const std::shared_ptr<std::atomic<bool>> given_up_ = std::make_shared<std::atomic<bool>>(false);

  // Set by start() before others see the stream, then constant.
  Principal principal_;
  std::shared_ptr<Tenant> tenant_;

  // Used by start() and OnDone() only: keeps the stream alive in between.
  std::shared_ptr<StepStream> self_;
  std::optional<Lifecycle::Call> call_;
  std::optional<Gate::Ticket> ticket_;

  // Used by the one outstanding read, and by who handles what it brought.
  grpc::ByteBuffer incoming_;
  // Used by who handles a message.
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
  Read read_ WARMFRONT_GUARDED_BY(mutex_) = Read::kNone;
  std::string token_ WARMFRONT_GUARDED_BY(mutex_);                             // offered, and not yet used
  std::shared_ptr<PacketConnection> connection_ WARMFRONT_GUARDED_BY(mutex_);  // null: not bound
  std::shared_ptr<StreamMemory> memory_ WARMFRONT_GUARDED_BY(mutex_);          // where bound
  bool on_stream_ WARMFRONT_GUARDED_BY(mutex_) = false;                        // the next message is gRPC's
  bool waits_for_room_ WARMFRONT_GUARDED_BY(mutex_) = false;  // current_ is to be sent by a packet
};

}  // namespace warmfront::server

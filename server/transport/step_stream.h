// SPDX-License-Identifier: Apache-2.0
// One StreamSteps call, from attach to end. Thread-safe.
#pragma once

#include <grpcpp/server_context.h>
#include <grpcpp/support/byte_buffer.h>
#include <grpcpp/support/server_callback.h>

#include <chrono>
#include <cstdint>
#include <deque>
#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include "server/admin/lifecycle.h"
#include "server/session/session.h"
#include "server/transport/context.h"
#include "warmfront/v1/step.pb.h"

namespace warmfront::server {

/// At most one read and one write are outstanding. A read is armed only while fewer than `window` frames are
/// in flight, and a frame is in flight until the last chunk of its answer is written: a client that does not
/// read is not read from, and what it costs is bounded by the window.
class StepStream final : public grpc::ServerBidiReactor<grpc::ByteBuffer, grpc::ByteBuffer>,
                         public Drainable,
                         public std::enable_shared_from_this<StepStream> {
 public:
  /// Lives until gRPC calls OnDone(). `context` outlives it.
  static StepStream* start(Context& context, const grpc::CallbackServerContext& call);

  void OnReadDone(bool ok) override;
  void OnWriteDone(bool ok) override;
  void OnCancel() override;
  void OnDone() override;

  void notify_draining(std::chrono::system_clock::time_point deadline) override;
  void end(const Fault& fault) override;
  void end_if_quiet(const Fault& fault, std::chrono::milliseconds quiet) override;

 private:
  struct Assembly {
    std::uint64_t frame;
    PositionBuffer positions;
  };
  struct Write {
    grpc::ByteBuffer message;
    bool ends_frame;
  };

  StepStream(Context& context, std::string metadata_id)
      : context_(context), metadata_id_(std::move(metadata_id)) {}

  // What a message asks for. Called by OnReadDone() only, without the lock.
  void handle(v1::StreamStepsRequest request);
  void attach(const v1::Attach& request);
  void take(v1::StepFrame frame);
  void half_closed();

  // Replies, from any thread, without the lock.
  void attached(const Outcome<std::uint64_t>& expected_frame);
  void answered(std::uint64_t frame, const Outcome<std::shared_ptr<const Answer>>& outcome);

  // With the lock held.
  void end_locked(grpc::Status status);
  void release_locked();
  void advance_locked();

  // Constant after construction.
  Context& context_;
  const std::string metadata_id_;

  // Used by start() and OnDone() only: keeps the stream alive in between.
  std::shared_ptr<StepStream> self_;
  std::optional<Lifecycle::Call> call_;

  // Used by the one outstanding read and OnReadDone() only.
  grpc::ByteBuffer incoming_;
  std::optional<Assembly> assembly_;

  // Protected by mutex_.
  std::mutex mutex_;
  std::shared_ptr<Session> session_;
  std::optional<Session::Attachment> attachment_;
  bool attaching_ = false;
  bool reading_ = false;
  bool handling_ = false;  // a message was read and is not yet counted in what follows from it
  bool writing_ = false;
  Write current_{};  // must outlive its write
  std::deque<Write> writes_;
  std::uint32_t in_flight_ = 0;
  std::chrono::steady_clock::time_point last_moved_ =
      std::chrono::steady_clock::now();  // a message, either way
  bool broken_ = false;                  // the client is gone: nothing can be delivered any more
  bool finished_ = false;                // Finish() was called
  std::optional<grpc::Status> end_;      // how to finish once all in flight is delivered
};

}  // namespace warmfront::server

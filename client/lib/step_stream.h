// SPDX-License-Identifier: Apache-2.0
// One StreamSteps call as blocking reads and writes, each with a time limit. Used by one thread at a time.
#pragma once

#include <grpcpp/grpcpp.h>

#include <array>
#include <chrono>
#include <deque>
#include <memory>
#include <optional>
#include <string>

#include "client/lib/connection.h"
#include "client/lib/look.h"
#include "client/lib/packet_channel.h"
#include "warmfront/v1/collision_service.grpc.pb.h"

namespace warmfront::client {

class StepStream {
 public:
  using Deadline = std::chrono::system_clock::time_point;
  enum class Event {
    kDone,
    kEnded,    ///< the call is over: see finish()
    kTimeout,  ///< the stream is unusable
  };

  /// Begins the call; `connection` must outlive the stream. `look` is called while anything is waited for.
  /// After it threw the stream is unusable unless whole().
  /// `traceparent`: as of Connection::prepare().
  StepStream(Connection& connection, const std::string& session_id, Look look = {},
             const std::string& traceparent = {});
  /// Cancels the call if it is not over.
  ~StepStream();
  StepStream(const StepStream&) = delete;
  StepStream& operator=(const StepStream&) = delete;

  /// Waits until the call has begun.
  Event start(Deadline deadline);
  /// Meanwhile messages are read and kept for read(), because the daemon stops reading frames while too many
  /// of its answers are pending. Each message sent or received restarts `timeout`.
  Event write(const v1::StreamStepsRequest& request, std::chrono::milliseconds timeout);
  /// Writes a serialized message.
  Event write(const grpc::ByteBuffer& message, std::chrono::milliseconds timeout);
  Event read(v1::StreamStepsResponse& response, Deadline deadline);
  /// Messages go by packets from now on, where the daemon binds the stream; after the attach was answered.
  void share(const std::string& path, const std::string& session_id, const std::string& token,
             std::uint64_t bytes);
  /// Memory that frames may be in; null where none is shared.
  SharedRegion* region() const { return packets_ ? packets_->region().get() : nullptr; }
  /// As PacketChannel has it.
  void ask_for_memory(std::uint64_t bytes) {
    if (packets_) packets_->ask_for(bytes);
  }
  /// The frame of which a first message without positions was written; its next is the last then.
  void begun(std::optional<std::uint64_t> frame) { begun_ = frame; }
  std::optional<std::uint64_t> begun() const { return begun_; }
  /// Is nothing half done but a read, which the next read() goes on with?
  bool whole() const { return whole_; }
  /// After kEnded: how the call ended. UNAVAILABLE if the status does not arrive in time.
  grpc::Status finish(Deadline deadline);

 private:
  enum Operation : std::size_t { kStart, kRead, kWrite, kFinish, kCount };
  enum class State { kNone, kFailed, kSucceeded };

  void* tag(Operation operation) { return &completed_[operation]; }
  Event take(Operation operation);
  /// Waits for this operation.
  Event await(Operation operation, Deadline deadline);
  /// Waits for any operation; false on timeout.
  bool await_any(Deadline deadline);
  Event write_to_stream(const grpc::ByteBuffer& message, std::chrono::milliseconds timeout);
  Event read_from_stream(v1::StreamStepsResponse& response, Deadline deadline);
  void begin_read();
  /// Moves the completed read into received_.
  void keep_read();

  const ChannelPool::Lease channel_;  // released last
  const Look look_;
  grpc::ClientContext context_;
  grpc::CompletionQueue queue_;
  // Requests as bytes: a frame's bytes are not copied into a message first.
  std::unique_ptr<grpc::ClientAsyncReaderWriter<grpc::ByteBuffer, v1::StreamStepsResponse>> call_;
  std::array<State, kCount> completed_{};  // written by completions, by address
  bool reading_ = false;                   // a read is in progress, or its completion not yet handled
  bool read_ended_ = false;
  bool whole_ = false;
  std::optional<std::uint64_t> begun_;
  std::unique_ptr<PacketChannel> packets_;        // null: all goes by the stream
  bool on_stream_ = false;                        // the next message does
  std::deque<v1::StreamStepsResponse> received_;  // during writes; at most a window of answers
  // Used by pending operations: must outlive the queue's drain.
  v1::StreamStepsResponse incoming_;
  grpc::Status status_;
};

}  // namespace warmfront::client

// SPDX-License-Identifier: Apache-2.0
// One StreamSteps call as blocking reads and writes, each with a time limit. Used by one thread at a time.
#pragma once

#include <grpcpp/grpcpp.h>

#include <array>
#include <chrono>
#include <deque>
#include <memory>
#include <string>

#include "client/lib/connection.h"
#include "warmfront/v1/collision_service.grpc.pb.h"

namespace warmfront::client {

class StepStream {
 public:
  using Deadline = std::chrono::system_clock::time_point;
  enum class Event {
    kDone,
    kEnded,    ///< the call is over: see finish()
    kTimeout,  ///< the stream is of no use any more
  };

  /// Begins the call; `connection` outlives the stream.
  StepStream(Connection& connection, const std::string& session_id);
  /// Cancels what is left of the call.
  ~StepStream();
  StepStream(const StepStream&) = delete;
  StepStream& operator=(const StepStream&) = delete;

  /// Waits until the call has begun.
  Event start(Deadline deadline);
  /// What comes meanwhile is read, and kept for read(): the daemon does not take more frames while too much
  /// of its answers waits to be taken. Each message that comes or goes counts `timeout` anew.
  Event write(const v1::StreamStepsRequest& request, std::chrono::milliseconds timeout);
  /// A message's bytes.
  Event write(const grpc::ByteBuffer& message, std::chrono::milliseconds timeout);
  Event read(v1::StreamStepsResponse& response, Deadline deadline);
  /// After kEnded: how the call ended. UNAVAILABLE when even that is not known in time.
  grpc::Status finish(Deadline deadline);

 private:
  enum Operation : std::size_t { kStart, kRead, kWrite, kFinish, kCount };
  enum class State { kNone, kFailed, kSucceeded };

  void* tag(Operation operation) { return &completed_[operation]; }
  Event take(Operation operation);
  /// Until it is complete.
  Event await(Operation operation, Deadline deadline);
  /// Until something is complete; false when nothing is in time.
  bool await_any(Deadline deadline);
  void begin_read();
  /// The read that is complete, into received_.
  void keep_read();

  const ChannelPool::Lease channel_;  // given back last
  grpc::ClientContext context_;
  grpc::CompletionQueue queue_;
  // Requests as bytes: those of a frame are not copied into a message first.
  std::unique_ptr<grpc::ClientAsyncReaderWriter<grpc::ByteBuffer, v1::StreamStepsResponse>> call_;
  std::array<State, kCount> completed_{};  // written by completions, by address
  bool reading_ = false;                   // a read is under way, or its end not yet looked at
  bool read_ended_ = false;
  std::deque<v1::StreamStepsResponse> received_;  // while writing; the answers of a window at most
  // Referred to by operations: they must outlive the queue's drain.
  v1::StreamStepsResponse incoming_;
  grpc::Status status_;
};

}  // namespace warmfront::client

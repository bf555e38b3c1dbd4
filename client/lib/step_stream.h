// SPDX-License-Identifier: Apache-2.0
// One StreamSteps call as blocking reads and writes, each with a time limit. Used by one thread at a time.
#pragma once

#include <grpcpp/grpcpp.h>

#include <array>
#include <chrono>
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
  Event write(const v1::StreamStepsRequest& request, Deadline deadline);
  /// A message's bytes.
  Event write(const grpc::ByteBuffer& message, Deadline deadline);
  Event read(v1::StreamStepsResponse& response, Deadline deadline);
  /// After kEnded: how the call ended. UNAVAILABLE when even that is not known in time.
  grpc::Status finish(Deadline deadline);

 private:
  enum Operation : std::size_t { kStart, kRead, kWrite, kFinish, kCount };
  enum class State { kNone, kFailed, kSucceeded };

  void* tag(Operation operation) { return &completed_[operation]; }
  Event await(Operation operation, Deadline deadline);

  grpc::ClientContext context_;
  grpc::CompletionQueue queue_;
  // Requests as bytes: those of a frame are not copied into a message first.
  std::unique_ptr<grpc::ClientAsyncReaderWriter<grpc::ByteBuffer, v1::StreamStepsResponse>> call_;
  std::array<State, kCount> completed_{};  // written by completions, by address
  // Referred to by operations: they must outlive the queue's drain.
  v1::StreamStepsResponse incoming_;
  grpc::Status status_;
};

}  // namespace warmfront::client

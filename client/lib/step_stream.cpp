// SPDX-License-Identifier: Apache-2.0
// A stream over a completion queue of its own: that is how gRPC gives single reads and writes a deadline.
// Thread safety as stated in the header.
#include "client/lib/step_stream.h"

#include <utility>

#include "proto/byte_buffer.h"

namespace warmfront::client {

StepStream::StepStream(Connection& connection, const std::string& session_id) {
  connection.prepare(context_, session_id);
  // A daemon that is about to come back is waited for, up to the deadline of start().
  context_.set_wait_for_ready(true);
  call_ = connection.prepare_step_stream(context_, queue_);
  call_->StartCall(tag(kStart));
}

StepStream::~StepStream() {
  context_.TryCancel();
  queue_.Shutdown();
  void* done = nullptr;
  bool ok = false;
  while (queue_.Next(&done, &ok)) {
  }
}

StepStream::Event StepStream::await(Operation operation, Deadline deadline) {
  while (completed_[operation] == State::kNone) {
    void* done = nullptr;
    bool ok = false;
    if (queue_.AsyncNext(&done, &ok, deadline) != grpc::CompletionQueue::GOT_EVENT) return Event::kTimeout;
    *static_cast<State*>(done) = ok ? State::kSucceeded : State::kFailed;
  }
  return std::exchange(completed_[operation], State::kNone) == State::kSucceeded ? Event::kDone
                                                                                 : Event::kEnded;
}

StepStream::Event StepStream::start(Deadline deadline) {
  return await(kStart, deadline);
}

StepStream::Event StepStream::write(const v1::StreamStepsRequest& request, Deadline deadline) {
  return write(serialize(request), deadline);
}

StepStream::Event StepStream::write(const grpc::ByteBuffer& message, Deadline deadline) {
  call_->Write(message, tag(kWrite));
  return await(kWrite, deadline);
}

StepStream::Event StepStream::read(v1::StreamStepsResponse& response, Deadline deadline) {
  call_->Read(&incoming_, tag(kRead));
  const Event event = await(kRead, deadline);
  if (event == Event::kDone) response = std::move(incoming_);
  return event;
}

grpc::Status StepStream::finish(Deadline deadline) {
  call_->Finish(&status_, tag(kFinish));
  if (await(kFinish, deadline) == Event::kDone) return status_;
  return {grpc::StatusCode::UNAVAILABLE, "the stream ended and its status did not arrive"};
}

}  // namespace warmfront::client

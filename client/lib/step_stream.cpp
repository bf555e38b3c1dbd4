// SPDX-License-Identifier: Apache-2.0
// A stream with its own completion queue, which is how gRPC gives single reads and writes a deadline. Thread
// safety as stated in the header.
#include "client/lib/step_stream.h"

#include <grpcpp/generic/generic_stub.h>

#include <utility>

#include "proto/byte_buffer.h"

namespace warmfront::client {

StepStream::StepStream(Connection& connection, const std::string& session_id, Look look)
    : channel_(connection.channel()), look_(std::move(look)) {
  connection.prepare(context_, session_id);
  // Wait for a restarting daemon, up to the deadline of start().
  context_.set_wait_for_ready(true);
  grpc::TemplatedGenericStub<grpc::ByteBuffer, v1::StreamStepsResponse> stub(channel_->channel);
  call_ = stub.PrepareCall(&context_, "/warmfront.v1.CollisionService/StreamSteps", &queue_);
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

StepStream::Event StepStream::take(Operation operation) {
  return std::exchange(completed_[operation], State::kNone) == State::kSucceeded ? Event::kDone
                                                                                 : Event::kEnded;
}

bool StepStream::await_any(Deadline deadline) {
  void* done = nullptr;
  bool ok = false;
  if (!next_event(queue_, done, ok, deadline, look_)) return false;
  *static_cast<State*>(done) = ok ? State::kSucceeded : State::kFailed;
  return true;
}

StepStream::Event StepStream::await(Operation operation, Deadline deadline) {
  while (completed_[operation] == State::kNone)
    if (!await_any(deadline)) return Event::kTimeout;
  return take(operation);
}

StepStream::Event StepStream::start(Deadline deadline) {
  const Event event = await(kStart, deadline);
  whole_ = event == Event::kDone;
  return event;
}

StepStream::Event StepStream::write(const v1::StreamStepsRequest& request,
                                    std::chrono::milliseconds timeout) {
  return write(serialize(request), timeout);
}

StepStream::Event StepStream::write(const grpc::ByteBuffer& message, std::chrono::milliseconds timeout) {
  whole_ = false;
  call_->Write(message, tag(kWrite));
  while (completed_[kWrite] == State::kNone) {
    begin_read();
    if (!await_any(deadline_after(timeout))) return Event::kTimeout;
    keep_read();
  }
  whole_ = true;
  return take(kWrite);
}

void StepStream::begin_read() {
  if (reading_ || read_ended_) return;
  call_->Read(&incoming_, tag(kRead));
  reading_ = true;
}

void StepStream::keep_read() {
  if (completed_[kRead] == State::kNone) return;
  reading_ = false;
  if (take(kRead) == Event::kDone)
    received_.push_back(std::move(incoming_));
  else
    read_ended_ = true;
}

StepStream::Event StepStream::read(v1::StreamStepsResponse& response, Deadline deadline) {
  while (received_.empty()) {
    if (read_ended_) return Event::kEnded;
    begin_read();
    if (completed_[kRead] == State::kNone && !await_any(deadline)) return Event::kTimeout;
    keep_read();
  }
  response = std::move(received_.front());
  received_.pop_front();
  return Event::kDone;
}

grpc::Status StepStream::finish(Deadline deadline) {
  whole_ = false;
  call_->Finish(&status_, tag(kFinish));
  if (await(kFinish, deadline) == Event::kDone) return status_;
  return {grpc::StatusCode::UNAVAILABLE, "the stream ended and its status did not arrive"};
}

}  // namespace warmfront::client

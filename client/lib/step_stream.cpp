// SPDX-License-Identifier: Apache-2.0
// A stream with its own completion queue, which is how gRPC gives single reads and writes a deadline. Thread
// safety as stated in the header.
#include "client/lib/step_stream.h"

#include <grpcpp/generic/generic_stub.h>

#include <utility>

#include "proto/byte_buffer.h"
#include "proto/wire/shared_columns.h"

namespace warmfront::client {

StepStream::StepStream(Connection& connection, const std::string& session_id, Look look,
                       const std::string& traceparent)
    : channel_(connection.channel()), look_(std::move(look)) {
  connection.prepare(context_, session_id, traceparent);
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

void StepStream::share(const std::string& path, const std::string& session_id, const std::string& token,
                       std::uint64_t bytes) {
  packets_ = PacketChannel::open(path, session_id, token, bytes);
}

StepStream::Event StepStream::write(const grpc::ByteBuffer& message, std::chrono::milliseconds timeout) {
  if (!packets_) return write_to_stream(message, timeout);
  const bool fits = message.Length() <= wire::kMostPacketBytes;
  std::vector<grpc::Slice> slices;
  std::string notice;
  std::vector<std::string_view> pieces;
  if (!fits) {
    v1::StreamStepsRequest request;
    request.mutable_on_stream();
    notice = request.SerializeAsString();
    pieces.emplace_back(notice);
  } else if (message.Dump(&slices).ok()) {
    for (const grpc::Slice& slice : slices)
      pieces.emplace_back(reinterpret_cast<const char*>(slice.begin()), slice.size());
  }
  switch (packets_->send(pieces, deadline_after(timeout))) {
    case PacketChannel::Event::kTimeout:
      whole_ = false;
      return Event::kTimeout;
    case PacketChannel::Event::kEnded:
      // What the daemon sent before is still to be read, and then why it ended.
      return Event::kEnded;
    case PacketChannel::Event::kDone:
      break;
  }
  return fits ? Event::kDone : write_to_stream(message, timeout);
}

StepStream::Event StepStream::write_to_stream(const grpc::ByteBuffer& message,
                                              std::chrono::milliseconds timeout) {
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
  while (packets_ && !on_stream_) {
    switch (packets_->receive(response, deadline, look_)) {
      case PacketChannel::Event::kTimeout:
        return Event::kTimeout;
      case PacketChannel::Event::kEnded:
        packets_.reset();  // the rest comes by the stream, and its end
        break;
      case PacketChannel::Event::kDone:
        if (!response.has_on_stream()) return Event::kDone;
        on_stream_ = true;
    }
  }
  const Event event = read_from_stream(response, deadline);
  if (event == Event::kDone) on_stream_ = false;
  return event;
}

StepStream::Event StepStream::read_from_stream(v1::StreamStepsResponse& response, Deadline deadline) {
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

// SPDX-License-Identifier: Apache-2.0
// A stream that is bound to a connection of packets: the same messages, to and fro, and memory that both ends
// see. Thread safety as stated in step_stream.h.
#include <array>
#include <utility>

#include "proto/byte_buffer.h"
#include "proto/wire/shared_columns.h"
#include "server/transport/convert.h"
#include "server/transport/errors.h"
#include "server/transport/heavy.h"
#include "server/transport/step_stream.h"
#include "server/transport/yield_to_steps.h"

namespace warmfront::server {
namespace {

static_assert(PacketConnection::kMostBytes == wire::kMostPacketBytes);

PacketConnection::Sent send(PacketConnection& connection, const grpc::ByteBuffer& message, int file = -1) {
  std::vector<grpc::Slice> slices;
  if (!message.Dump(&slices).ok()) return PacketConnection::Sent::kLost;
  std::vector<std::string_view> pieces;
  pieces.reserve(slices.size());
  for (const grpc::Slice& slice : slices)
    pieces.emplace_back(reinterpret_cast<const char*>(slice.begin()), slice.size());
  return connection.send(pieces, file);
}

/// A message, or null: the notice that it comes by the stream. Without memory the connection counts as lost,
/// and the stream takes its place: a write that has begun must go somewhere.
PacketConnection::Sent send_noexcept(PacketConnection& connection, const grpc::ByteBuffer* message) noexcept {
  try {
    if (message != nullptr) return send(connection, *message);
    v1::StreamStepsResponse notice;
    notice.mutable_on_stream();
    return send(connection, serialize(notice));
  } catch (const std::exception&) {
    return PacketConnection::Sent::kLost;
  }
}

/// A message of which there is a descriptor.
bool send_memory(PacketConnection& connection, const Outcome<std::shared_ptr<StreamMemory>>& memory) {
  v1::StreamStepsResponse response;
  v1::SharedMemory& said = *response.mutable_shared_memory();
  int file = -1;
  if (memory) {
    said.set_bytes(memory.value()->mapping().size());
    file = memory.value()->mapping().file();
  } else {
    *said.mutable_error() = to_proto(memory.fault());
  }
  const bool sent = send(connection, serialize(response), file) == PacketConnection::Sent::kWhole;
  if (memory) memory.value()->mapping().release_file();
  return sent;
}

}  // namespace

bool StepStream::bind(const std::shared_ptr<PacketConnection>& connection,
                      const v1::SharedMemoryRequest& request) {
  bool bound = false;
  guarded([&] {
    std::shared_ptr<Session> session;
    {
      const MutexLock lock(mutex_);
      token_.clear();
      if (state_.course != StreamCourse::kOpen || connection_ || !session_ ||
          session_->id().text() != request.session_id())
        return;
      session = session_;
    }
    Outcome<std::shared_ptr<StreamMemory>> memory =
        StreamMemory::create(session->account(), request.bytes(), context_.shared_bytes);
    if (!memory) context_.count_refused(memory.fault(), tenant_.get());
    // A stream that ended meanwhile ends the connection as well.
    const MutexLock lock(mutex_);
    if (state_.course != StreamCourse::kOpen || !send_memory(*connection, memory) || !memory) return;
    bound = true;
    connection_ = connection;
    memory_ = std::move(memory).value();
    if (state_.read == StreamRead::kReading) connection_->want_packet();
  });
  return bound;
}

void StepStream::give_memory(const v1::SharedMemoryRequest& request) {
  std::shared_ptr<Session> session;
  std::shared_ptr<PacketConnection> connection;
  {
    const MutexLock lock(mutex_);
    if (!connection_) return;
    session = session_;
    connection = connection_;
  }
  Outcome<std::shared_ptr<StreamMemory>> memory =
      StreamMemory::create(session->account(), request.bytes(), context_.shared_bytes);
  if (!memory) context_.count_refused(memory.fault(), tenant_.get());
  const MutexLock lock(mutex_);
  if (connection_ != connection) return;
  if (!send_memory(*connection, memory)) return connection_->shut();
  if (memory) memory_ = std::move(memory).value();
}

Outcome<AnswerRoom> StepStream::take_shared(StreamRequest& request, std::shared_ptr<StreamMemory>& memory) {
  v1::StepFrame& step = *request.message.mutable_step();
  if (!step.has_shared_positions() && !step.has_shared_moved() && !step.has_answer_room())
    return AnswerRoom();
  std::shared_ptr<Session> session;
  {
    const MutexLock lock(mutex_);
    memory = memory_;
    session = session_;
  }
  const bool others = assembly_->has_begun() || !request.positions.empty();
  Outcome<SharedParts> parts = take_shared_parts(step, others, memory);
  if (!parts) return parts.fault();
  // The client may write there meanwhile: each byte is read once, and what is recorded is what is computed.
  const bool is_recorded = session->companion() != nullptr;
  if (const std::optional<std::string_view> positions = parts.value().positions) {
    if (is_recorded)
      step.set_positions(std::string(*positions));
    else
      request.positions.push_back(*positions);
  }
  if (const std::optional<MovedPiece> moved = parts.value().moved) {
    if (is_recorded)
      *step.mutable_moved() = to_proto(*moved);
    else
      request.moved = moved;
  }
  return std::move(parts).value().room;
}

bool StepStream::packet(const std::shared_ptr<PacketConnection>& from, std::string_view packet) noexcept {
  yield_to_steps(context_.runner.backlog());
  handling([&] {
    {
      const MutexLock lock(mutex_);
      // Else the call is about to end.
      if (connection_ != from || on_stream_ || state_.read != StreamRead::kReading) return;
      last_moved_ = Clock::now();
      happened_locked(StreamEvent::Kind::kReadDone);
    }
    const grpc::Slice slice(packet.data(), packet.size());
    grpc::ByteBuffer message(&slice, 1);
    handle_message(message, Way::kPacket);
  });
  return true;
}

void StepStream::has_room(const std::shared_ptr<PacketConnection>& on) noexcept {
  guarded([&] {
    const MutexLock lock(mutex_);
    if (connection_ != on || !std::exchange(waits_for_room_, false)) return;
    send_locked();
    advance_locked();
  });
}

void StepStream::lost(const std::shared_ptr<PacketConnection>& which) noexcept {
  guarded([&] {
    const MutexLock lock(mutex_);
    if (connection_ != which) return;
    const bool unsent = std::exchange(waits_for_room_, false);
    unbind_locked();
    if (unsent) StartWrite(&current_);  // else it was dropped, with what waited behind it
    if (state_.read == StreamRead::kReading) take_waiting_locked();
    advance_locked();
  });
}

void StepStream::unbind_locked() {
  if (!connection_) return;
  connection_->shut();
  connection_.reset();
  memory_.reset();
  on_stream_ = false;
}

void StepStream::send_locked() {
  if (connection_) {
    const bool fits = current_.Length() <= PacketConnection::kMostBytes;
    switch (send_noexcept(*connection_, fits ? &current_ : nullptr)) {
      case PacketConnection::Sent::kWhole:
        if (!fits) break;
        return written_locked();
      case PacketConnection::Sent::kLater:
        waits_for_room_ = true;
        return;
      case PacketConnection::Sent::kLost:
        unbind_locked();
        break;
    }
  }
  StartWrite(&current_);
}

void StepStream::written_locked() {
  last_moved_ = Clock::now();
  if (ending_trace_) {
    ending_trace_->sent = last_moved_;
    context_.tracer->finish(std::move(ending_trace_));
  }
  current_.Clear();
  current_bytes_.set(0);
  happened_locked(StreamEvent::Kind::kWriteDone);
}

void StepStream::begin_read_locked() {
  if (read_ == Read::kNone) {
    read_ = Read::kOutstanding;
    StartRead(&incoming_);
  }
  if (read_ != Read::kOutstanding && (!connection_ || on_stream_ || read_ == Read::kEndWaits))
    return take_waiting_locked();
  if (connection_ && !on_stream_)
    connection_->want_packet(state_.awaiting ? PacketConnection::When::kSoon
                                             : PacketConnection::When::kLater);
}

void StepStream::take_waiting_locked() {
  if (read_ != Read::kMessageWaits && read_ != Read::kEndWaits) return;
  const bool ok = std::exchange(read_, Read::kNone) == Read::kMessageWaits;
  on_stream_ = false;
  happened_locked(StreamEvent::Kind::kReadDone);
  try {
    run_in_turn(context_, tenant_,
                [self = shared_from_this(), ok] { self->handling([&] { self->handle_read(ok); }); });
  } catch (const std::exception&) {
    if (!end_ || end_->ok()) end_ = status_of_exception();
    break_locked(StreamEvent::Kind::kHandlingFailed);
  }
}

}  // namespace warmfront::server

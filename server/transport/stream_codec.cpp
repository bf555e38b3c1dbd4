// SPDX-License-Identifier: Apache-2.0
// StreamSteps messages from and to bytes. Thread-safe.
#include "server/transport/stream_codec.h"

#include <google/protobuf/io/coded_stream.h>
#include <grpcpp/impl/codegen/proto_utils.h>

#include <algorithm>
#include <optional>
#include <utility>

#include "proto/byte_buffer.h"
#include "server/transport/convert.h"
#include "server/transport/errors.h"

namespace warmfront::server {
namespace {

using google::protobuf::io::CodedInputStream;

constexpr std::uint32_t kVarint = 0;
constexpr std::uint32_t kLengthDelimited = 2;

constexpr std::uint32_t tag_of(int field, std::uint32_t wire_type) {
  return static_cast<std::uint32_t>(field) << 3 | wire_type;
}

/// The next bytes, where they are.
bool take_bytes(CodedInputStream& in, int size, std::vector<std::string_view>& pieces) {
  while (size > 0) {
    const void* data = nullptr;
    int here = 0;
    if (!in.GetDirectBufferPointer(&data, &here)) return false;
    here = std::min(here, size);
    pieces.emplace_back(static_cast<const char*>(data), static_cast<std::size_t>(here));
    if (!in.Skip(here)) return false;
    size -= here;
  }
  return true;
}

/// A question, and places in shared memory, are a few numbers: what is longer has something that they do not
/// have.
template <class Message>
bool read_numbers(CodedInputStream& in, Message& message) {
  constexpr std::uint32_t kLongest = 256;
  std::uint32_t length = 0;
  std::string bytes;
  return in.ReadVarint32(&length) && length <= kLongest && in.ReadString(&bytes, static_cast<int>(length)) &&
         message.ParseFromString(bytes);
}

/// A step of positions as clients write it: one of each field, and nothing else. What is written otherwise,
/// or wrongly, is for the general parser.
std::optional<StreamRequest> read_positions_step(grpc::ByteBuffer& buffer) {
  const std::size_t total = buffer.Length();
  grpc::ProtoBufferReader reader(&buffer);
  if (!reader.status().ok()) return std::nullopt;
  CodedInputStream in(&reader);
  const auto left = [&] { return total - static_cast<std::size_t>(in.CurrentPosition()); };
  std::uint32_t length = 0;
  if (in.ReadTag() != tag_of(v1::StreamStepsRequest::kStepFieldNumber, kLengthDelimited) ||
      !in.ReadVarint32(&length) || length != left())
    return std::nullopt;
  StreamRequest request;
  v1::StepFrame& step = *request.message.mutable_step();
  while (left() > 0) {
    std::uint64_t value = 0;
    switch (in.ReadTag()) {
      case tag_of(v1::StepFrame::kFrameFieldNumber, kVarint):
        if (!in.ReadVarint64(&value)) return std::nullopt;
        step.set_frame(value);
        break;
      case tag_of(v1::StepFrame::kMoreFieldNumber, kVarint):
        if (!in.ReadVarint64(&value)) return std::nullopt;
        step.set_more(value != 0);
        break;
      case tag_of(v1::StepFrame::kPositionsFieldNumber, kLengthDelimited):
        if (!request.positions.empty() || !in.ReadVarint32(&length) || length > left() ||
            !take_bytes(in, static_cast<int>(length), request.positions))
          return std::nullopt;
        break;
      case tag_of(v1::StepFrame::kQuestionFieldNumber, kLengthDelimited):
        if (step.has_question() || !read_numbers(in, *step.mutable_question())) return std::nullopt;
        break;
      case tag_of(v1::StepFrame::kSharedPositionsFieldNumber, kLengthDelimited):
        if (step.has_shared_positions() || !read_numbers(in, *step.mutable_shared_positions()))
          return std::nullopt;
        break;
      case tag_of(v1::StepFrame::kSharedMovedFieldNumber, kLengthDelimited):
        if (step.has_shared_moved() || !read_numbers(in, *step.mutable_shared_moved())) return std::nullopt;
        break;
      case tag_of(v1::StepFrame::kAnswerRoomFieldNumber, kLengthDelimited):
        if (step.has_answer_room() || !read_numbers(in, *step.mutable_answer_room())) return std::nullopt;
        break;
      default:
        return std::nullopt;
    }
  }
  return request;
}

}  // namespace

Outcome<v1::StreamStepsRequest> parse_request(grpc::ByteBuffer& buffer) {
  const std::size_t size = buffer.Length();
  v1::StreamStepsRequest request;
  const grpc::Status parsed =
      grpc::SerializationTraits<v1::StreamStepsRequest>::Deserialize(&buffer, &request);
  if (!parsed.ok())
    return Fault{ErrorCode::kInvalidArgument, Reason::kInvalidInput,
                 "StreamSteps: " + std::to_string(size) + " bytes are no warmfront.v1.StreamStepsRequest"};
  if (request.message_case() == v1::StreamStepsRequest::MESSAGE_NOT_SET)
    return Fault{ErrorCode::kInvalidArgument, Reason::kInvalidInput,
                 "StreamSteps: a message of " + std::to_string(size) +
                     " bytes carries none of step, attach, detach and commit"};
  return request;
}

v1::StepFrame StreamRequest::whole_step() const {
  v1::StepFrame step = message.step();
  std::size_t bytes = 0;
  for (const std::string_view piece : positions) bytes += piece.size();
  if (bytes > 0) step.mutable_positions()->reserve(bytes);
  for (const std::string_view piece : positions) step.mutable_positions()->append(piece);
  return step;
}

Outcome<StreamRequest> read_request(grpc::ByteBuffer& buffer, ParseRoom& room) {
  if (std::optional<StreamRequest> request = read_positions_step(buffer)) return *std::move(request);
  static const MessageLayout& layout = MessageLayout::of(*v1::StreamStepsRequest::descriptor());
  Outcome<ParseRoom::Place> place = room.enter(buffer, layout, "StreamSteps");
  if (!place) return place.fault();
  Outcome<v1::StreamStepsRequest> parsed = parse_request(buffer);
  if (!parsed) return parsed.fault();
  return StreamRequest{std::move(place).value(), std::move(parsed).value(), {}, {}};
}

AnswerChunks::AnswerChunks(std::shared_ptr<const Answer> answer, std::size_t chunk_bytes, AnswerRoom room)
    : answer_(std::move(answer)),
      chunk_bytes_(chunk_bytes),
      items_(by_vertex() ? answer_->vertex_distances.size() : answer_->rows()),
      items_per_chunk_(
          std::max<std::size_t>(chunk_bytes / (by_vertex() ? sizeof(double) : answer_->bytes_per_row()), 1)),
      room_(std::move(room)) {}

grpc::ByteBuffer AnswerChunks::next() {
  if (room_.memory && first_ == 0 && first_world_ == 0) {
    v1::StreamStepsResponse response;
    v1::StepAnswer& whole = *response.mutable_answer();
    if (put_columns(*answer_, room_, *whole.mutable_shared())) {
      whole.set_frame(answer_->frame);
      return last_part(response);
    }
    room_ = {};
  }
  const std::size_t count = std::min(items_per_chunk_, items_ - first_);
  const std::size_t worlds = next_worlds(count);
  const bool last = first_ + count == items_ && first_world_ + worlds == answer_->worlds.size();
  v1::StreamStepsResponse response;
  v1::StepAnswer& part = *response.mutable_answer();
  part.set_frame(answer_->frame);
  if (by_vertex())
    fill_distances(*answer_, first_, count, *part.mutable_vertex_distances());
  else
    fill_columns(*answer_, first_, count, *part.mutable_contacts());
  if (worlds > 0)
    fill_worlds(*answer_, first_world_, worlds, *part.mutable_worlds(), *part.mutable_world_tois());
  if (last) return last_part(response);
  grpc::ByteBuffer chunk = serialize(response);
  first_ += count;
  first_world_ += worlds;
  return chunk;
}

grpc::ByteBuffer AnswerChunks::last_part(v1::StreamStepsResponse& response) {
  response.mutable_answer()->set_last(true);
  *response.mutable_answer()->mutable_summary() = summary_of(*answer_);
  grpc::ByteBuffer chunk = serialize(response);
  done_ = true;
  return chunk;
}

std::size_t AnswerChunks::next_worlds(std::size_t rows) const {
  if (first_ + rows < items_) return 0;
  const std::size_t taken = by_vertex() ? 0 : rows * answer_->bytes_per_row();
  const std::size_t room = (chunk_bytes_ - std::min(taken, chunk_bytes_)) / Answer::kBytesPerWorld;
  const std::size_t least = rows == 0 ? 1 : 0;  // each part brings something
  return std::min(std::max(room, least), answer_->worlds.size() - first_world_);
}

grpc::ByteBuffer encode_error(std::uint64_t frame, const Fault& fault) {
  v1::StreamStepsResponse response;
  *response.mutable_error()->mutable_status() = to_proto(fault);
  response.mutable_error()->set_frame(frame);
  return serialize(response);
}

}  // namespace warmfront::server

// SPDX-License-Identifier: Apache-2.0
// StreamSteps messages from and to bytes. Thread-safe.
#include "server/transport/stream_codec.h"

#include <grpcpp/impl/codegen/proto_utils.h>

#include <algorithm>
#include <utility>

#include "server/transport/convert.h"
#include "server/transport/errors.h"

namespace warmfront::server {

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
                     " bytes carries none of step, attach and detach"};
  return request;
}

grpc::ByteBuffer serialize(const v1::StreamStepsResponse& response) {
  grpc::ByteBuffer buffer;
  bool own_buffer = false;
  const grpc::Status status =
      grpc::SerializationTraits<v1::StreamStepsResponse>::Serialize(response, &buffer, &own_buffer);
  // Only a message beyond 2 GiB cannot be serialised, and the chunks are far smaller.
  if (!status.ok()) buffer.Clear();
  return buffer;
}

AnswerChunks::AnswerChunks(std::shared_ptr<const Answer> answer, std::size_t chunk_bytes)
    : answer_(std::move(answer)),
      rows_per_chunk_(std::max<std::size_t>(chunk_bytes / answer_->bytes_per_row(), 1)) {}

grpc::ByteBuffer AnswerChunks::next() {
  const std::size_t count = std::min(rows_per_chunk_, answer_->rows() - first_);
  const bool last = first_ + count == answer_->rows();
  v1::StreamStepsResponse response;
  v1::StepAnswer& part = *response.mutable_answer();
  part.set_frame(answer_->frame);
  fill_columns(*answer_, first_, count, *part.mutable_contacts());
  if (last) {
    part.set_last(true);
    *part.mutable_summary() = summary_of(*answer_);
  }
  grpc::ByteBuffer chunk = serialize(response);
  first_ += count;
  done_ = last;
  return chunk;
}

grpc::ByteBuffer encode_error(std::uint64_t frame, const Fault& fault) {
  v1::StreamStepsResponse response;
  *response.mutable_error()->mutable_status() = to_proto(fault);
  response.mutable_error()->set_frame(frame);
  return serialize(response);
}

}  // namespace warmfront::server

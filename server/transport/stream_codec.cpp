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

std::vector<grpc::ByteBuffer> encode_answer(const Answer& answer, std::size_t chunk_bytes) {
  const std::size_t rows_per_chunk = std::max<std::size_t>(chunk_bytes / Answer::kBytesPerRow, 1);
  std::vector<grpc::ByteBuffer> chunks;
  chunks.reserve(answer.rows() / rows_per_chunk + 1);
  std::size_t first = 0;
  do {
    const std::size_t count = std::min(rows_per_chunk, answer.rows() - first);
    v1::StreamStepsResponse response;
    v1::StepAnswer& part = *response.mutable_answer();
    part.set_frame(answer.frame);
    fill_columns(answer, first, count, *part.mutable_contacts());
    first += count;
    if (first == answer.rows()) {
      part.set_last(true);
      *part.mutable_summary() = summary_of(answer);
    }
    chunks.push_back(serialize(response));
  } while (first < answer.rows());
  return chunks;
}

grpc::ByteBuffer encode_error(std::uint64_t frame, const Fault& fault) {
  v1::StreamStepsResponse response;
  *response.mutable_error()->mutable_status() = to_proto(fault);
  response.mutable_error()->set_frame(frame);
  return serialize(response);
}

}  // namespace warmfront::server

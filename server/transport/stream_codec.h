// SPDX-License-Identifier: Apache-2.0
// The messages of StreamSteps to and from raw buffers. A typed stream reports bytes that are no message just
// as it reports a clean half-close; parsing them here tells the two apart. Thread-safe.
#pragma once

#include <grpcpp/support/byte_buffer.h>

#include <vector>

#include "server/session/answer.h"
#include "server/session/fault.h"
#include "warmfront/v1/step.pb.h"

namespace warmfront::server {

/// INVALID_ARGUMENT for bytes that are no message, and for a message that carries none of step, attach and
/// detach. `buffer` is consumed.
Outcome<v1::StreamStepsRequest> parse_request(grpc::ByteBuffer& buffer);

grpc::ByteBuffer serialize(const v1::StreamStepsResponse& response);

/// The answer in chunks of at most `chunk_bytes` of contacts (at least one row each), the last one marked and
/// with the summary. An answer without rows is one chunk.
std::vector<grpc::ByteBuffer> encode_answer(const Answer& answer, std::size_t chunk_bytes);

grpc::ByteBuffer encode_error(std::uint64_t frame, const Fault& fault);

}  // namespace warmfront::server

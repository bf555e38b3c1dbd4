// SPDX-License-Identifier: Apache-2.0
// Frames as gRPC byte buffers that refer to the positions without a copy. Thread-safe.
#pragma once

#include <grpcpp/support/byte_buffer.h>

#include <cstddef>
#include <cstdint>

#include "client/lib/frame_bytes.h"
#include "warmfront/v1/step.pb.h"

namespace warmfront::client {

/// A step that carries positions [at, at + count) bytes of `positions`, without a copy of them: the buffer
/// holds on to them. Positions are most of what a step costs to send, and a message object would copy
/// them twice.
/// With a question, unless it is null: in the first message of a frame.
grpc::ByteBuffer positions_message(std::uint64_t frame, bool more, const FrameBytes& positions,
                                   std::size_t at, std::size_t count, const v1::Question* question = nullptr);

}  // namespace warmfront::client

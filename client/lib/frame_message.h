// SPDX-License-Identifier: Apache-2.0
// Frames as gRPC byte buffers that refer to the positions without a copy. Thread-safe.
#pragma once

#include <grpcpp/support/byte_buffer.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>

#include "warmfront/v1/step.pb.h"

namespace warmfront::client {

/// A step with positions [at, at + count) bytes of the string, not copied: the buffer shares the string.
/// Positions are most of a step's sending cost, and a message object would copy them twice.
grpc::ByteBuffer positions_message(std::uint64_t frame, bool more,
                                   const std::shared_ptr<const std::string>& positions, std::size_t at,
                                   std::size_t count);

}  // namespace warmfront::client

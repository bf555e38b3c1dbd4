// SPDX-License-Identifier: Apache-2.0
// Serialized messages for gRPC's generic calls. Thread-safe.
#pragma once

#include <grpcpp/impl/codegen/proto_utils.h>
#include <grpcpp/support/byte_buffer.h>

namespace warmfront {

/// The bytes of a message; none beyond 2 GiB, which cannot be serialized.
template <class Message>
grpc::ByteBuffer serialize(const Message& message) {
  grpc::ByteBuffer buffer;
  bool own_buffer = false;
  if (!grpc::SerializationTraits<Message>::Serialize(message, &buffer, &own_buffer).ok()) buffer.Clear();
  return buffer;
}

}  // namespace warmfront

// SPDX-License-Identifier: Apache-2.0
// Messages as gRPC's generic calls send them. Thread-safe.
#pragma once

#include <grpcpp/impl/codegen/proto_utils.h>
#include <grpcpp/support/byte_buffer.h>

namespace warmfront {

/// The bytes of a message; none of one beyond 2 GiB, which cannot be serialised.
template <class Message>
grpc::ByteBuffer serialize(const Message& message) {
  grpc::ByteBuffer buffer;
  bool own_buffer = false;
  if (!grpc::SerializationTraits<Message>::Serialize(message, &buffer, &own_buffer).ok()) buffer.Clear();
  return buffer;
}

}  // namespace warmfront

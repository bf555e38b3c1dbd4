// SPDX-License-Identifier: Apache-2.0
// Messages that take longer to parse than a reaction may: gRPC has two threads for the reactions of all clients
// on a machine of up to four cores, and two such messages would hold up everyone. They are parsed on the
// runner's threads, in their principal's turn. Thread-safe.
#pragma once

#include <grpcpp/support/byte_buffer.h>

#include <cstddef>

#include "server/transport/parsed_size.h"

namespace warmfront::server {

/// Whether what is in strings is copied while a message is parsed.
enum class Strings : unsigned char { kCopied, kLeftInPlace };

/// More fields than are parsed in a fraction of a millisecond, or more bytes than are copied in one. Costs a
/// look at so many fields at most.
inline bool is_heavy(const grpc::ByteBuffer& bytes, const MessageLayout& type, Strings strings) {
  constexpr std::size_t kLight = std::size_t{64} << 10, kBytes = std::size_t{1} << 20, kFields = 1 << 14;
  const std::size_t length = bytes.Length();
  if (length <= kLight) return false;
  return (strings == Strings::kCopied && length > kBytes) || has_more_fields(bytes, type, kFields);
}

}  // namespace warmfront::server

// SPDX-License-Identifier: Apache-2.0
// Messages that take longer to parse than a reaction may: gRPC has two threads for the reactions of all
// clients on a machine of up to four cores, and two such messages would hold up everyone. They are parsed on
// the runner's threads, in their principal's turn. Thread-safe.
#pragma once

#include <grpcpp/support/byte_buffer.h>

#include <cstddef>
#include <memory>
#include <utility>

#include "server/transport/context.h"
#include "server/transport/parsed_size.h"

namespace warmfront::server {

/// Whether what is in strings is copied while a message is parsed.
enum class Strings : unsigned char { kCopied, kLeftInPlace };

/// More fields than are parsed in a fraction of a millisecond, or more bytes than are copied in one. Costs a
/// look at so many fields at most.
template <class Message>
bool is_heavy(const grpc::ByteBuffer& bytes, Strings strings) {
  constexpr std::size_t kLight = std::size_t{64} << 10, kBytes = std::size_t{1} << 20, kFields = 1 << 14;
  const std::size_t length = bytes.Length();
  if (length <= kLight) return false;
  return (strings == Strings::kCopied && length > kBytes) ||
         has_more_fields(bytes, layout_of<Message>(), kFields);
}

/// Runs `work`, which parses a heavy message, on a thread of the runner, in the tenant's turn. It must not
/// throw. Throws, and runs nothing, when there is no memory for it.
template <class Work>
void run_in_turn(Context& context, std::shared_ptr<Tenant> tenant, Work work) {
  Share& share = tenant->share;
  context.runner.post(std::move(work), Lane::kLong, std::shared_ptr<Share>(std::move(tenant), &share));
}

}  // namespace warmfront::server

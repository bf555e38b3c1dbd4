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

enum class Weight : unsigned char {
  kLight,
  kLong,       ///< more bytes than are copied in a fraction of a millisecond
  kManyFields  ///< more fields than are parsed in one; of up to 30 MiB, it may take 50 ms
};

/// Costs a look at as many fields as are light, at most.
template <class Message>
Weight weight_of(const grpc::ByteBuffer& bytes, Strings strings) {
  constexpr std::size_t kLight = std::size_t{64} << 10, kBytes = std::size_t{1} << 20, kFields = 1 << 14;
  const std::size_t length = bytes.Length();
  if (length <= kLight) return Weight::kLight;
  if (has_more_fields(bytes, layout_of<Message>(), kFields)) return Weight::kManyFields;
  return strings == Strings::kCopied && length > kBytes ? Weight::kLong : Weight::kLight;
}

/// Runs `work`, which parses a heavy message, on a thread of the runner, in the tenant's turn; one of many
/// fields, which no client of ours sends, behind whatever else wants the cores. It must not throw. Throws, and
/// runs nothing, when there is no memory for it.
template <class Work>
void run_in_turn(Context& context, std::shared_ptr<Tenant> tenant, Weight weight, Work work) {
  Share& share = tenant->share;
  auto in_turn = [&runner = context.runner, weight, work = std::move(work)]() mutable {
    if (weight == Weight::kManyFields) runner.step_back_now();
    work();
  };
  context.runner.post(std::move(in_turn), Lane::kLong, std::shared_ptr<Share>(std::move(tenant), &share));
}

}  // namespace warmfront::server

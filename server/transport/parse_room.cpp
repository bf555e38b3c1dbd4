// SPDX-License-Identifier: Apache-2.0
// Letting messages in. Thread safety as stated in the header.
#include "server/transport/parse_room.h"

#include <chrono>
#include <string>

#include "server/units.h"

namespace warmfront::server {
namespace {

constexpr const char* kSetting = "max-message-bytes";
/// Below this a message counts as the worst that its bytes could become, and is not looked at.
constexpr std::size_t kNotWorthALook = std::size_t{1} << 20;
constexpr std::chrono::seconds kOverrun{2};

}  // namespace

Outcome<ParseRoom::Place> ParseRoom::enter(const grpc::ByteBuffer& message, const MessageLayout& type,
                                           const char* method) {
  const std::size_t length = message.Length();
  std::size_t bytes = type.most(length);
  if (bytes > kNotWorthALook) bytes = parsed_size(message, type, limit_);
  if (bytes > limit_)
    return limit_met(std::string(method) + ": a message of " + describe_bytes(length) +
                         " would become more than " + describe_bytes(limit_) +
                         " in memory; send fewer parts in one, or raise --" + kSetting,
                     kSetting, false);
  const auto deadline = std::chrono::steady_clock::now() + kOverrun;
  UniqueLock lock(mutex_);
  while (bytes > limit_ - used_)
    if (left_.wait_until(lock, deadline) == std::cv_status::timeout && bytes > limit_ - used_)
      return limit_met(std::string(method) + ": messages that are being read hold " + describe_bytes(used_) +
                           " of the " + describe_bytes(limit_) + " that they may; try again, or raise --" +
                           kSetting,
                       kSetting, true);
  used_ += bytes;
  return Place(*this, bytes);
}

void ParseRoom::leave(std::size_t bytes) {
  {
    const MutexLock lock(mutex_);
    used_ -= bytes;
  }
  left_.notify_all();
}

std::size_t ParseRoom::used() const {
  const MutexLock lock(mutex_);
  return used_;
}

}  // namespace warmfront::server

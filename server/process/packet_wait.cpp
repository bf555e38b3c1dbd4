// SPDX-License-Identifier: Apache-2.0
#include "server/process/packet_wait.h"

#include <algorithm>

namespace warmfront::server {
namespace {

/// In vain so often in a row, as a power of two, it is tried only every so many times.
constexpr std::uint32_t kMostMissed = 8;

}  // namespace

PacketWait::Time PacketWait::next(When when, Time later) {
  Patience& patience = patience_[static_cast<std::size_t>(when)];
  if (patience.skip == 0) return when == When::kSoon ? kSoon : later;
  --patience.skip;
  return Time(0);
}

void PacketWait::ended(When when, bool came) {
  Patience& patience = patience_[static_cast<std::size_t>(when)];
  patience.missed = came ? 0 : std::min(patience.missed + 1, kMostMissed);
  patience.skip = (std::uint32_t{1} << patience.missed) - 1;
}

}  // namespace warmfront::server

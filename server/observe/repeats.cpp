// SPDX-License-Identifier: Apache-2.0
// Thread safety as stated in the header.
#include "server/observe/repeats.h"

#include <functional>
#include <utility>

namespace warmfront::server {

std::optional<std::uint64_t> Repeats::admit(std::string_view words,
                                            std::chrono::steady_clock::time_point now) {
  const MutexLock lock(mutex_);
  Place& place = places_[std::hash<std::string_view>{}(words) % places_.size()];
  if (place.last && now - *place.last < std::chrono::seconds(1)) {
    ++place.left_out;
    return std::nullopt;
  }
  place.last = now;
  return std::exchange(place.left_out, 0);
}

}  // namespace warmfront::server

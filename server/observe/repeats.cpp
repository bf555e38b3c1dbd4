// SPDX-License-Identifier: Apache-2.0
// Thread safety as stated in the header.
#include "server/observe/repeats.h"

#include <algorithm>
#include <functional>
#include <utility>

namespace warmfront::server {

std::optional<std::uint64_t> Repeats::admit(std::string_view words,
                                            std::chrono::steady_clock::time_point now) {
  const std::size_t hash = std::hash<std::string_view>{}(words);
  const auto is_free = [now](const Place& place) {
    return !place.last || now - *place.last >= std::chrono::seconds(1);
  };
  const MutexLock lock(mutex_);
  auto place = std::ranges::find_if(places_, [hash](const Place& p) { return p.last && p.words == hash; });
  if (place == places_.end()) {
    place = std::ranges::find_if(places_, is_free);
    if (place == places_.end()) {
      ++others_;
      return std::nullopt;
    }
    others_ += place->left_out;
    *place = {hash, std::nullopt, 0};
  }
  if (!is_free(*place)) {
    ++place->left_out;
    return std::nullopt;
  }
  place->last = now;
  return std::exchange(place->left_out, 0) + std::exchange(others_, 0);
}

}  // namespace warmfront::server

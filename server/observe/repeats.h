// SPDX-License-Identifier: Apache-2.0
// Whoever floods the daemon does not flood its log. Thread-safe.
#pragma once

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string_view>

#include "server/annotations.h"

namespace warmfront::server {

/// Lets the same words through once a second, and all together 32 times.
class Repeats {
 public:
  /// How often these words were left out since they last came through, and others that found no place or gave
  /// theirs up; nothing when they are left out now.
  std::optional<std::uint64_t> admit(
      std::string_view words, std::chrono::steady_clock::time_point now = std::chrono::steady_clock::now());

 private:
  struct Place {
    std::size_t words = 0;  ///< by their hash
    std::optional<std::chrono::steady_clock::time_point> last;
    std::uint64_t left_out = 0;
  };
  Mutex mutex_;
  std::array<Place, 32> places_ WARMFRONT_GUARDED_BY(mutex_){};
  std::uint64_t others_ WARMFRONT_GUARDED_BY(mutex_) = 0;  ///< left out, and not in a place
};

}  // namespace warmfront::server

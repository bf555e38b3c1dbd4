// SPDX-License-Identifier: Apache-2.0
// When a connection's next packet is waited for without sleeping: a thread that sleeps is some 50
// microseconds late. A pure value, used by one thread at a time.
#pragma once

#include <array>
#include <chrono>
#include <cstdint>

namespace warmfront::server {

class PacketWait {
 public:
  using Time = std::chrono::microseconds;
  /// When a packet will come: soon of what has begun, or at some time later.
  enum class When : std::uint8_t { kLater, kSoon };

  /// About what waking up takes, so that in vain it costs no more than it might have saved.
  static constexpr Time kLater{50};
  /// The rest of a frame, whose client writes its positions meanwhile: of some 20 MB.
  static constexpr Time kSoon{500};

  /// For how long the next one is, from now on; 0: not at all, since the last ones came later than that.
  Time next(When when, Time later = kLater);
  /// It came in that time, or not.
  void ended(When when, bool came);

 private:
  struct Patience {
    std::uint32_t missed = 0;  // times in a row that it was in vain
    std::uint32_t skip = 0;    // times more that it is not tried
  };
  std::array<Patience, 2> patience_;  // by When
};

}  // namespace warmfront::server

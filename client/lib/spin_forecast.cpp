// SPDX-License-Identifier: Apache-2.0
#include "client/lib/spin_forecast.h"

#include <algorithm>

namespace warmfront::client {
namespace {

using Time = SpinForecast::Time;

/// What is waited for anyhow: as long as short steps take.
constexpr Time kLeast{200};
/// Windows are that long, and this share of the waiting more; never longer than the most.
constexpr double kShare = 0.4;
constexpr Time kMost{4000};
/// A thread that sleeps until the window begins wakes up so much late.
constexpr Time kLate{120};
/// How far answers are off beyond what the last ones were.
constexpr Time kMargin{60};
/// Missed so often in a row, as a power of two, it is tried only every so many times.
constexpr std::uint32_t kMostMissed = 6;

}  // namespace

std::optional<SpinForecast::Window> SpinForecast::next() {
  if (skip_ > 0) {
    --skip_;
    return std::nullopt;
  }
  if (count_ == 0) return Window{Time(0), kLeast};
  // One that is far off on either side says nothing of the next.
  std::array<Time, kKept> waits = last_;
  const auto end = waits.begin() + static_cast<std::ptrdiff_t>(std::min(count_, kKept));
  std::sort(waits.begin(), end);
  const bool many = count_ >= kKept;
  const Time least = many ? waits[1] : waits.front();
  const Time most = many ? *(end - 2) : *(end - 1);
  const Time begin = least - kMargin - kLate;
  const Window window{begin < kLate ? Time(0) : begin, std::max(most + kMargin, kLeast)};
  if (window.end - window.begin > std::min(kLeast + kShare * least, kMost)) return std::nullopt;
  return window;
}

void SpinForecast::came(Time after, const std::optional<Window>& window) {
  last_[count_++ % kKept] = after;
  if (!window) return;
  missed_ = after > window->end ? std::min(missed_ + 1, kMostMissed) : 0;
  skip_ = (std::uint32_t{1} << missed_) - 1;
}

}  // namespace warmfront::client

// SPDX-License-Identifier: Apache-2.0
// The least toi found so far in each world, of which Report::kEarliest drops what is later. Written and read
// by all threads during a step; begin() by one.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "engine/scene/held_bytes.h"

namespace warmfront {

class EarliestTimes {
 public:
  static constexpr double kNone = 2;  ///< later than any contact

  void begin(std::size_t worlds) { times_.assign(worlds, kNone); }
  /// Of a world's place: see Worlds.
  double of(std::uint32_t place) const { return at(place).load(std::memory_order_relaxed); }
  /// Takes a toi. Returns what is the least then.
  double lower(std::uint32_t place, double toi) {
    const std::atomic_ref<double> least = at(place);
    double now = least.load(std::memory_order_relaxed);
    while (toi < now && !least.compare_exchange_weak(now, toi, std::memory_order_relaxed)) {
    }
    return toi < now ? toi : now;
  }

  std::size_t memory_bytes() const { return held_bytes(times_); }

 private:
  std::atomic_ref<double> at(std::uint32_t place) const { return std::atomic_ref<double>(times_[place]); }

  mutable std::vector<double> times_;  // each read and written atomically
};

}  // namespace warmfront

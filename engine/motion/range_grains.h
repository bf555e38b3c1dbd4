// SPDX-License-Identifier: Apache-2.0
// Loops over a range of vertices in grains, a task each, that note which grains a step has begun.
#pragma once

#include <algorithm>
#include <cstdint>
#include <mutex>
#include <span>

#include "engine/motion/motion.h"
#include "engine/parallel/fork_join.h"
#include "engine/stop.h"

namespace warmfront {

/// Vertices that are worth a task of their own.
inline constexpr std::uint32_t kGrain = 512;

inline std::uint32_t grains_of(std::uint32_t first, std::uint32_t end) {
  return (end - first + kGrain - 1) / kGrain;
}

// RangeMotion::begun, with room for so many grains.
inline std::span<std::uint8_t> begun_grains(RangeMotion& range, std::uint32_t grains) {
  if (grains <= 1) return {&range.only_grain_begun, grains};
  range.begun.resize(grains);
  return range.begun;
}

// What a grain of a range came to.
struct Moved {
  MotionState any = 0;
  MotionState all = kMoving | kChanged;
  double reach = 0;

  void add(MotionState state) {
    any |= state;
    all &= state;
  }
  void add(const Moved& other) {
    any |= other.any;
    all &= other.all;
    reach = std::max(reach, other.reach);
  }
};

// What of_grain(begin, end, moved) adds for all grains of a range; each is marked as begun before. Looks at
// the flag before each, so that what was begun is done.
template <class OfGrain>
Moved over_grains(std::uint32_t first, std::uint32_t end, RangeMotion& range, StopSignal stop,
                  OfGrain&& of_grain) {
  const std::uint32_t grains = grains_of(first, end);
  const std::span<std::uint8_t> begun = begun_grains(range, grains);
  std::ranges::fill(begun, std::uint8_t{0});
  Moved sum;
  if (grains <= 1) {  // one of many small bodies: a task costs as much as its vertices
    stop.check();
    std::ranges::fill(begun, std::uint8_t{1});
    of_grain(first, end, sum);
    return sum;
  }
  std::mutex mutex;
  fork_each(std::uint32_t{0}, grains, [&](std::uint32_t grain) {
    stop.check();
    const std::uint32_t begin = first + grain * kGrain;
    begun[grain] = 1;
    Moved moved;
    of_grain(begin, std::min(begin + kGrain, end), moved);
    const std::lock_guard lock(mutex);
    sum.add(moved);
  });
  return sum;
}

// Runs of_vertex(v, moved) for all vertices of a range.
template <class OfVertex>
Moved over_range(std::uint32_t first, std::uint32_t end, RangeMotion& range, StopSignal stop,
                 OfVertex&& of_vertex) {
  return over_grains(first, end, range, stop,
                     [&](std::uint32_t grain, std::uint32_t grain_end, Moved& moved) {
                       for (std::uint32_t v = grain; v < grain_end; ++v) of_vertex(v, moved);
                     });
}

}  // namespace warmfront

// SPDX-License-Identifier: Apache-2.0
// Parallel loops and sorting that look at a stop flag, however many turns a thread takes at a time.
// Thread-safe.
#pragma once

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_sort.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "engine/parallel/stop.h"

namespace warmfront {

/// Calls `body(begin, end)` for pieces of [first, end) of `most` turns at most, in parallel; throws Stopped
/// when told to stop. Call it inside Workers::run().
template <class Body>
void for_pieces(std::size_t first, std::size_t end, std::size_t most, StopSignal stop, Body&& body) {
  if (first >= end) return;
  tbb::parallel_for(tbb::blocked_range<std::size_t>(first, end, most), [&](const auto& range) {
    for (std::size_t begin = range.begin(); begin < range.end(); begin += most) {
      stop.check();
      body(begin, std::min(begin + most, range.end()));
    }
  });
}

/// The same, turn by turn: `body(i)`.
template <class Body>
void for_each_index(std::size_t first, std::size_t end, StopSignal stop, Body&& body,
                    std::size_t most = PacedStop::kEvery) {
  for_pieces(first, end, most, stop, [&](std::size_t from, std::size_t to) {
    for (std::size_t i = from; i < to; ++i) body(i);
  });
}

/// Sorts a list in parallel. Throws Stopped when told to stop; the list holds the same elements then, in some
/// order.
template <class List, class Less>
void sort_in_parallel(List& list, StopSignal stop, Less&& less) {
  constexpr std::size_t kFew = 4 * std::size_t{PacedStop::kEvery};
  if (list.size() < kFew) {
    stop.check();
    tbb::parallel_sort(list.begin(), list.end(), less);
    return;
  }
  tbb::parallel_sort(list.begin(), list.end(), [&](const auto& x, const auto& y) {
    thread_local std::uint32_t compared = 0;
    if (++compared % PacedStop::kEvery == 0) stop.check();
    return less(x, y);
  });
}

}  // namespace warmfront

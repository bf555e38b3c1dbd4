// SPDX-License-Identifier: Apache-2.0
// A result of many elements in parallel, for any order of them: a largest value, a count. Thread-safe.
#pragma once

#include <cstddef>
#include <mutex>

#include "engine/parallel/stoppable_loops.h"

namespace warmfront {

/// What `of_piece(begin, end)` makes of each piece of [first, end), `join`ed to `none` in any order: so that
/// the result is the same for any number of threads, join(all, piece) is to be commutative and associative,
/// to the bit. Throws Stopped when told to stop. Allocates nothing; inline where there is only one piece.
template <class Result, class OfPiece, class Join>
Result join_pieces(std::size_t first, std::size_t end, StopSignal stop, Result none, OfPiece&& of_piece,
                   Join&& join, std::size_t most = std::size_t{2} * PacedStop::kEvery,
                   ForkPlace place = ForkPlace::here()) {
  Result all = none;
  if (end - first <= most) {
    stop.check();
    join(all, of_piece(first, end));
    return all;
  }
  std::mutex mutex;
  const auto of_each = [&](std::size_t begin, std::size_t piece_end) {
    const Result piece = of_piece(begin, piece_end);
    const std::lock_guard lock(mutex);
    join(all, piece);
  };
  for_pieces(first, end, most, stop, of_each, place);
  return all;
}

}  // namespace warmfront

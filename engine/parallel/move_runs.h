// SPDX-License-Identifier: Apache-2.0
// Lists of which parts go and others come: what stays is moved within the memory that there is, so that a
// change touches what it moves and nothing else. Thread-safe for different lists.
#pragma once

#include <algorithm>
#include <cstddef>
#include <span>
#include <type_traits>
#include <vector>

#include "engine/parallel/stoppable_loops.h"

namespace warmfront {

/// `count` items of a list that are at `from`, and will be at `to`.
struct Run {
  std::size_t from = 0;
  std::size_t count = 0;
  std::size_t to = 0;
};

/// Makes room for move_runs() to `size` items, and somewhat more, so that lists that grow and shrink a little
/// again and again stay where they are. Changes no item. Throws Stopped when told to stop.
template <class T>
void make_room_for_runs(std::vector<T>& list, std::size_t size, StopSignal stop) {
  constexpr std::size_t kRoomToGrow = 16;  // one of so many
  if (list.capacity() < size) reserve(list, size + size / kRoomToGrow, stop);
}

/// Moves runs, in their order before and after, to where they will be in a list of `size` items, for which
/// there is room; what is in no run then is left over from before. O(what moves).
template <class T>
void move_runs(std::vector<T>& list, std::span<const Run> runs, std::size_t size) noexcept {
  static_assert(std::is_trivially_copyable_v<T>);
  if (list.size() < size) list.resize(size);
  const auto at = [&](std::size_t place) { return list.begin() + static_cast<std::ptrdiff_t>(place); };
  // One that goes up has its place free when all after it have gone up, and one that goes down when all
  // before it have; neither comes to where one of the others still is.
  for (const Run& run : runs) {
    if (run.to < run.from) std::copy(at(run.from), at(run.from + run.count), at(run.to));
  }
  for (std::size_t i = runs.size(); i > 0; --i) {
    const Run& run = runs[i - 1];
    if (run.to > run.from) std::copy_backward(at(run.from), at(run.from + run.count), at(run.to + run.count));
  }
  list.resize(size);
  if (list.capacity() > 2 * size) list.shrink_to_fit();  // where there is memory for that
}

}  // namespace warmfront

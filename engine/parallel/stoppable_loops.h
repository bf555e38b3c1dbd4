// SPDX-License-Identifier: Apache-2.0
// Loops, copies and sorting that check a stop flag at bounded intervals. Thread-safe.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "engine/parallel/fork_join.h"
#include "engine/parallel/large_pages.h"
#include "engine/stop.h"

namespace warmfront {

/// Calls `body(begin, end)` for pieces of [first, end) of at most `most` iterations, in parallel; throws
/// Stopped when told to stop. Call it inside Workers::run().
template <class Body>
void for_pieces(std::size_t first, std::size_t end, std::size_t most, StopSignal stop, Body&& body,
                ForkPlace place = ForkPlace::here()) {
  if (first >= end) return;
  const auto of_range = [&](const auto& range) {
    for (std::size_t begin = range.begin(); begin < range.end(); begin += most) {
      stop.check();
      body(begin, std::min(begin + most, range.end()));
    }
  };
  fork_range(first, end, most, of_range, place);
}

/// The same per index: `body(i)`.
template <class Body>
void for_each_index(std::size_t first, std::size_t end, StopSignal stop, Body&& body,
                    std::size_t most = PacedStop::kEvery, ForkPlace place = ForkPlace::here()) {
  const auto of_piece = [&](std::size_t from, std::size_t to) {
    for (std::size_t i = from; i < to; ++i) body(i);
  };
  for_pieces(first, end, most, stop, of_piece, place);
}

/// Calls `body(begin, end)` for pieces of [first, end) of at most `most` iterations, in order on this thread;
/// for iterations of a few nanoseconds.
template <class Body>
void in_pieces(std::size_t first, std::size_t end, StopSignal stop, Body&& body,
               std::size_t most = std::size_t{8} * PacedStop::kEvery) {
  for (std::size_t begin = first; begin < end; begin += most) {
    stop.check();
    body(begin, std::min(begin + most, end));
  }
}

/// Elements of a list that are written per piece: the system maps memory page by page on first touch, a third
/// of a microsecond each.
template <class T>
constexpr std::size_t kFreshAtOnce = std::max<std::size_t>(1, (std::size_t{1} << 20) / sizeof(T));

template <class T, class Allocator>
void reserve(std::vector<T, Allocator>& list, std::size_t size, StopSignal stop);

/// Appends to a list. Touches new memory, and moves old elements, piece by piece. Throws Stopped when told to
/// stop; the list may then be longer than before, and nothing else is changed.
template <class T, class Allocator>
void append(std::vector<T, Allocator>& list, std::span<const T> more, StopSignal stop) {
  reserve(list, list.size() + more.size(), stop);
  const auto append_piece = [&](std::size_t begin, std::size_t end) {
    list.insert(list.end(), more.begin() + static_cast<std::ptrdiff_t>(begin),
                more.begin() + static_cast<std::ptrdiff_t>(end));
  };
  in_pieces(0, more.size(), stop, append_piece, kFreshAtOnce<T>);
}

/// Grows a list to `size` elements, as append() does. Must not shrink it.
template <class T>
void lengthen(std::vector<T>& list, std::size_t size, const T& value, StopSignal stop) {
  reserve(list, size, stop);
  const auto lengthen_to = [&](std::size_t, std::size_t end) { list.resize(end, value); };
  in_pieces(list.size(), size, stop, lengthen_to, kFreshAtOnce<T>);
}

/// Reserves exactly `size` elements if the capacity is less.
template <class T, class Allocator>
void reserve(std::vector<T, Allocator>& list, std::size_t size, StopSignal stop) {
  if (size <= list.capacity()) return;
  std::vector<T, Allocator> roomier;
  roomier.reserve(size);
  prefer_large_pages(roomier.data(), size * sizeof(T));
  append(roomier, std::span<const T>(list), stop);
  list = std::move(roomier);
}

/// Sorts a list on this thread. Throws Stopped when told to stop; the list then holds the same elements in
/// unspecified order.
template <class List, class Less>
void sort_stoppably(List& list, StopSignal stop, Less&& less) {
  PacedStop paced(stop, 256);
  std::ranges::sort(list, [&](const auto& x, const auto& y) {
    paced.check();
    return less(x, y);
  });
}

/// Sorts a list in parallel. Throws Stopped when told to stop; the list then holds the same elements in
/// unspecified order.
template <class List, class Less>
void sort_in_parallel(List& list, StopSignal stop, Less&& less, ForkPlace place = ForkPlace::here()) {
  constexpr std::size_t kFew = 4 * std::size_t{PacedStop::kEvery};
  if (list.size() < kFew) {
    stop.check();
    fork_sort(list.begin(), list.end(), less, place);
    return;
  }
  const auto compare = [&](const auto& x, const auto& y) {
    thread_local std::uint32_t compared = 0;
    if (++compared % PacedStop::kEvery == 0) stop.check();
    return less(x, y);
  };
  fork_sort(list.begin(), list.end(), compare, place);
}

}  // namespace warmfront

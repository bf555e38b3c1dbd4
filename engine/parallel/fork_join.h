// SPDX-License-Identifier: Apache-2.0
// Where the engine forks into tasks and joins: oneTBB's loops, which a ForkTrace of the calling thread, if it
// has one, runs task by task on this thread instead. Thread-safe.
#pragma once

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_invoke.h>
#include <tbb/parallel_sort.h>

#include <algorithm>
#include <cstddef>
#include <iterator>

#include "engine/parallel/fork_trace.h"

namespace warmfront {

/// Calls `body(i)` for each of [first, end), a task each at most.
template <class Index, class Body>
void fork_each(Index first, Index end, const Body& body, ForkPlace place = ForkPlace::here()) {
  ForkTrace* const trace = ForkTrace::of_thread();
  if (trace == nullptr) return tbb::parallel_for(first, end, body);
  const ForkTrace::Fork fork(*trace, place);
  for (Index i = first; i < end; ++i) {
    const ForkTrace::Task task(*trace);
    body(i);
  }
}

/// Calls `body(range)` for blocked_ranges that cover [first, end), of `grain` or more each.
template <class Index, class Body>
void fork_range(Index first, Index end, std::size_t grain, const Body& body,
                ForkPlace place = ForkPlace::here()) {
  using Range = tbb::blocked_range<Index>;
  ForkTrace* const trace = ForkTrace::of_thread();
  if (trace == nullptr) return tbb::parallel_for(Range(first, end, grain), body);
  const ForkTrace::Fork fork(*trace, place);
  while (first < end) {
    const auto next = static_cast<Index>(first + std::min<std::size_t>(grain, end - first));
    const ForkTrace::Task task(*trace);
    body(Range(first, next, grain));
    first = next;
  }
}

/// Runs each of these, two or more. The place is named first: a pack takes all that follows.
template <class... Bodies>
void fork_all(const ForkPlace& place, const Bodies&... bodies) {
  ForkTrace* const trace = ForkTrace::of_thread();
  if (trace == nullptr) return tbb::parallel_invoke(bodies...);
  const ForkTrace::Fork fork(*trace, place);
  const auto run = [trace](const auto& body) {
    const ForkTrace::Task task(*trace);
    body();
  };
  (run(bodies), ...);
}

template <class Left, class Right>
void fork_two(const Left& left, const Right& right, ForkPlace place = ForkPlace::here()) {
  fork_all(place, left, right);
}

/// Sorts. In a trace it is a quicksort as oneTBB's is: each partition is serial, its sides are tasks.
template <class Iterator, class Less>
void fork_sort(Iterator first, Iterator last, const Less& less, ForkPlace place = ForkPlace::here()) {
  constexpr std::ptrdiff_t kSerialBelow = 500;
  if (ForkTrace::of_thread() == nullptr) return tbb::parallel_sort(first, last, less);
  if (last - first < kSerialBelow) return std::sort(first, last, less);
  const Iterator middle = first + (last - first) / 2;
  std::nth_element(first, middle, last, less);
  fork_two([&] { fork_sort(first, middle, less, place); }, [&] { fork_sort(middle, last, less, place); },
           place);
}

}  // namespace warmfront

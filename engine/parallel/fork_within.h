// SPDX-License-Identifier: Apache-2.0
// Forking from within a task that holds what is its thread's alone. Thread-safe.
#pragma once

#include <tbb/task_arena.h>

#include "engine/parallel/fork_join.h"

namespace warmfront {

/// Are there so many threads here that tasks of a few microseconds pay? Few are evenly busy without them. A
/// recording, which is asked about many cores, counts as many.
inline bool among_many_threads() {
  constexpr int kMany = 8;
  return ForkTrace::of_thread() != nullptr || tbb::this_task_arena::max_concurrency() >= kMany;
}

/// As fork_each(); while the calling thread waits for the tasks that others took, it takes no task but these:
/// what its task keeps by thread, such as scratch memory, is left alone.
template <class Index, class Body>
void fork_within(Index first, Index end, const Body& body, ForkPlace place = ForkPlace::here()) {
  tbb::this_task_arena::isolate([&] { fork_each(first, end, body, place); });
}

}  // namespace warmfront

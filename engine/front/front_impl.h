// SPDX-License-Identifier: Apache-2.0
// What the front needs for the tasks of a step (front.cpp runs them, front_plan.cpp says which there are).
#pragma once

#include <tbb/enumerable_thread_specific.h>

#include <cstddef>
#include <cstdint>
#include <vector>

#include "engine/front/build_tasks.h"
#include "engine/front/chunk_update.h"
#include "engine/front/front.h"

namespace warmfront {

/// What one task does: builds a chunk below a pair, updates a chunk, or one of neighbours, or hands over what
/// a segment keeps.
template <class Bounds>
struct Front<Bounds>::Work {
  enum Kind : std::uint8_t { kBuild, kUpdate, kNeighbours, kReuse } kind;
  std::size_t segment;
  std::size_t chunk;
  Answers answers;
  BuildTask task{};
};

template <class Bounds>
struct Front<Bounds>::Impl {
  tbb::enumerable_thread_specific<ChunkScratch> scratch;
  std::vector<Work> works;  // of the step
  std::vector<Work> first;  // those that begin before them
  std::uint64_t heavy = 0;  // what a chunk costs that does
};

}  // namespace warmfront

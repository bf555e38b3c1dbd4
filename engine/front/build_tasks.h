// SPDX-License-Identifier: Apache-2.0
// Decomposition of front building into inter- and self-collision tasks. Source: Tang, Manocha, Tong 2009,
// section 5.2. Pure function.
#pragma once

#include <cstdint>
#include <vector>

#include "engine/front/node_pair.h"

namespace warmfront {

/// A part of the BVTT, below a pair whose separation() is known.
struct BuildTask {
  NodePair pair;
  float gap;  ///< positive: traversal ends here
};

struct BuildTasks {
  std::vector<BuildTask> tasks;  ///< in depth-first order
  std::uint64_t bv_tests = 0;    ///< spent while decomposing
};

/// Opens the costliest tasks from the root until none is estimated above a small share of the whole. The
/// estimate is in bounding volume tests: for a node of n leaves against itself, n (log2 n + 1); for two
/// nodes, the share of the leaves of each that its overlap with the other suggests (Klein, Zachmann 2005), at
/// least one path. Depends on the data alone.
template <class Bounds>
BuildTasks decompose(const Bvh<Bounds>& bvh);

}  // namespace warmfront

// SPDX-License-Identifier: Apache-2.0
// Decomposition of front building into inter- and self-collision tasks. Source: Tang, Manocha, Tong 2009,
// section 5.2. Pure functions, to be called inside Workers::run().
#pragma once

#include <cstdint>
#include <vector>

#include "engine/front/descend.h"

namespace warmfront {

/// A part of a BVTT, below a pair whose separation() is known.
struct BuildTask {
  NodePair pair;
  float gap;  ///< positive: traversal ends here
};

/// An estimate in bounding volume tests of what lies below a pair: for a node of n leaves against itself,
/// n (log2 n + 1); for two nodes, the share of the leaves of each that its overlap with the other suggests
/// (Klein, Zachmann 2005), at least one path. Depends on the data alone.
template <class Bounds>
double build_cost(const TreePair<Bounds>& trees, const NodePair& pair);

/// Opens the costliest tasks from the root until none is estimated above `most`. In depth-first order; adds
/// the tests it took to `bv_tests`.
template <class Bounds>
std::vector<BuildTask> decompose(const TreePair<Bounds>& trees, double most, std::uint64_t& bv_tests);

}  // namespace warmfront

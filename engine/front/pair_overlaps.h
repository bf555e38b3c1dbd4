// SPDX-License-Identifier: Apache-2.0
// Overlap tests of a run of front pairs. Pure functions.
#pragma once

#include <cstdint>
#include <span>

#include "engine/front/node_pair.h"

namespace warmfront {

/// Writes to flags[i] whether the nodes of pairs[i] overlap; `flags` has room for pairs.size().
void overlaps(const Aabb* nodes, std::span<const NodePair> pairs, std::uint8_t* flags);
void overlaps(const KDop18* nodes, std::span<const NodePair> pairs, std::uint8_t* flags);

}  // namespace warmfront

// SPDX-License-Identifier: Apache-2.0
#include "engine/front/pair_overlaps.h"

#include "engine/bounds/lanes.h"

namespace warmfront {
namespace {

template <class Bounds>
WARMFRONT_INLINE void meet_pairs(const Bounds* nodes, std::span<const NodePair> pairs, std::uint8_t* flags) {
  for (std::size_t i = 0; i < pairs.size(); ++i) flags[i] = meet(nodes[pairs[i].a], nodes[pairs[i].b]);
}

}  // namespace

WARMFRONT_TARGET_CLONES
void overlaps(const Aabb* nodes, std::span<const NodePair> pairs, std::uint8_t* flags) {
  meet_pairs(nodes, pairs, flags);
}

WARMFRONT_TARGET_CLONES
void overlaps(const KDop18* nodes, std::span<const NodePair> pairs, std::uint8_t* flags) {
  meet_pairs(nodes, pairs, flags);
}

}  // namespace warmfront

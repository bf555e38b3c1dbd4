// SPDX-License-Identifier: Apache-2.0
// Which blocks of a hierarchy take what came to a body. Pure functions.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "engine/stop.h"

namespace warmfront {

/// Some blocks that held primitives of a vertex.
class BlocksAround {
 public:
  void add(std::uint32_t block) {
    if (count_ < blocks_.size() && !holds(block)) blocks_[count_++] = block;
  }
  bool holds(std::uint32_t block) const { return std::ranges::find(blocks(), block) != blocks().end(); }
  std::span<const std::uint32_t> blocks() const { return std::span(blocks_).first(count_); }

 private:
  std::array<std::uint32_t, 6> blocks_{};
  std::size_t count_ = 0;
};

/// A primitive that came, by what held primitives of its vertices; one may be named several times.
using Newcomer = std::array<const BlocksAround*, 3>;

/// How many primitives a block can take.
struct BlockRoom {
  std::uint32_t gaps = 0;  ///< in place of those that went
  std::uint32_t all = 0;   ///< with these
};

/// The nearest of `count` blocks around one, itself first, of which something is true; `count` for none
/// within kReach.
inline constexpr std::uint32_t kReach = 32;
template <class Holds>
std::uint32_t nearest_block(std::uint32_t block, std::uint32_t count, Holds&& holds) {
  for (std::uint32_t away = 0; away <= kReach; ++away) {
    if (block >= away && holds(block - away)) return block - away;
    if (block + away < count && holds(block + away)) return block + away;
  }
  return count;
}

/// The block of each. As many as can be take a gap in one that held primitives of their vertices: where all
/// gaps are filled, everything that stayed has the number that it had. The others go to one with room that
/// held most of their vertices, or to one near by. Empty where there is no room within kReach blocks. `rooms`
/// is by block. O(newcomers + blocks), and for each newcomer whose gap is not around it the blocks that are
/// nearer than that gap. Throws Stopped when told to stop.
std::vector<std::uint32_t> fill_blocks(std::span<const Newcomer> newcomers, std::vector<BlockRoom> rooms,
                                       StopSignal stop);

}  // namespace warmfront

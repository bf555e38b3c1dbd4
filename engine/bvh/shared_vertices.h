// SPDX-License-Identifier: Apache-2.0
// Which primitives in a hierarchy's blocks share a vertex, and so are never tested against each other by
// their bounds (the same holds for empty slots): found once for an order of primitives, looked up in every
// step. Immutable once built.
#pragma once

#include <algorithm>
#include <cstdint>
#include <limits>
#include <memory>
#include <span>
#include <vector>

#include "engine/bvh/tree_shape.h"
#include "engine/scene.h"
#include "engine/scene/held_bytes.h"
#include "engine/scene/primitives.h"
#include "engine/stop.h"

namespace warmfront {

/// Eight rows of eight bits become eight columns (Warren, Hacker's Delight, 7-3).
inline std::uint64_t transposed(std::uint64_t bits) {
  const auto swap = [&bits](int distance, std::uint64_t mask) {
    const std::uint64_t differ = (bits ^ (bits >> distance)) & mask;
    bits ^= differ ^ (differ << distance);
  };
  swap(7, 0x00aa00aa00aa00aa);
  swap(14, 0x0000cccc0000cccc);
  swap(28, 0x00000000f0f0f0f0);
  return bits;
}

/// The pairs of two blocks' slots that do not exist, bit 8 i + j for slot i of a and slot j of b; for one
/// block with itself, all except i < j.
inline std::uint64_t no_pairs(std::uint32_t count_a, std::uint32_t count_b, bool same) {
  constexpr std::uint64_t kEachRow = 0x0101010101010101;
  constexpr std::uint64_t kNotBeyond = 0xff7f3f1f0f070301;
  const std::uint64_t rows = count_a < 8 ? ~std::uint64_t{0} << (8 * count_a) : 0;
  const std::uint64_t columns = (0xff & (0xff << count_b)) * kEachRow;
  return rows | columns | (same ? kNotBeyond : 0);
}

class SharedVertices {
 public:
  static constexpr std::uint32_t kBlockSize = 8;
  /// Vertices of more faces and lone edges are left out, since each pair of their blocks would be listed.
  static constexpr std::size_t kMostAround = 64;

  SharedVertices() = default;
  /// Block b holds `blocks[b]`, at most kBlockSize primitives of `scene`, whose vertices are a range. O(P).
  /// Throws Stopped when told to stop.
  SharedVertices(const Scene& scene, std::span<const std::span<const Primitive>> blocks,
                 StopSignal stop = {});

  /// The same of all of `scene`, where some are as they were in `before`, of which only the blocks marked
  /// hold something else, or in other slots. Vertices have the numbers that they had, but for where these
  /// begin.
  SharedVertices(const Scene& scene, std::span<const std::span<const Primitive>> blocks,
                 const SharedVertices& before, std::span<const std::uint8_t> changed, StopSignal stop);
  /// Can another one be made from this one? Not where a block is crowded().
  bool can_be_followed() const { return crowded_.empty(); }

  /// Bit 8 i + j: slot i of block a and slot j of block b are not to be tested against each other, because
  /// their primitives share a vertex or the pair does not exist (no_pairs()). 0 for blocks that share no
  /// vertex, even if slots are empty. Where both blocks are crowded(), some bits may be missing.
  std::uint64_t of(BlockId a, BlockId b) const {
    return a <= b ? in_row(number_of(a), number_of(b)) : transposed(in_row(number_of(b), number_of(a)));
  }
  /// Calls `visit(b)` for blocks b >= a that share a vertex with block a, itself first, each once; except
  /// those that did not fit in a's row.
  template <class Visit>
  void for_neighbours(BlockId a, Visit&& visit) const {
    const std::size_t row = std::size_t{kRow} * number_of(a);
    for (std::size_t place = row; place < row + kRow && others_[place] != kNone; ++place)
      visit(BlockId{others_[place]});
  }
  /// As of(), for two blocks that for_neighbours() does not visit.
  std::uint64_t of_no_place(BlockId a, BlockId b) const {
    return a <= b ? beyond_row(number_of(a), number_of(b))
                  : transposed(beyond_row(number_of(b), number_of(a)));
  }
  /// Does for_neighbours(a) visit b?
  bool has_place(BlockId a, BlockId b) const {
    return place_in_row(number_of(std::min(a, b)), number_of(std::max(a, b))) != kNone;
  }
  /// Does for_neighbours(a) visit the same blocks, in the same order, for another one of as many?
  bool has_same_row(BlockId a, const SharedVertices& other) const {
    const auto first = others_.begin() + std::ptrdiff_t{kRow} * number_of(a);
    return std::equal(first, first + kRow, other.others_.begin() + std::ptrdiff_t{kRow} * number_of(a));
  }
  /// Does the block have a vertex that was left out?
  bool crowded(BlockId block) const { return !crowded_.empty() && crowded_[number_of(block)] != 0; }

  std::size_t memory_bytes() const {
    return sizeof(*this) + held_bytes(others_, pairs_, more_, has_more_, crowded_);
  }

  bool operator==(const SharedVertices&) const = default;

 private:
  // In here all numbers are indices of blocks, or made from them: a BlockId would only be converted back.
  static constexpr std::uint32_t kRow = 12;
  static constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();

  struct More {
    std::uint32_t owner;
    std::uint32_t other;
    std::uint64_t pairs;
    bool operator==(const More&) const = default;
  };

  // Branchless over the whole row: the exit is unpredictable.
  std::uint32_t place_in_row(std::uint32_t owner, std::uint32_t other) const {
    const std::size_t row = std::size_t{kRow} * owner;
    std::uint32_t found = 0;
    for (std::uint32_t i = 0; i < kRow; ++i) found |= others_[row + i] == other ? i + 1 : 0;
    return found != 0 ? found - 1 : kNone;
  }
  std::uint64_t in_row(std::uint32_t owner, std::uint32_t other) const {
    const std::uint32_t place = place_in_row(owner, other);
    return place != kNone ? pairs_[std::size_t{kRow} * owner + place] : beyond_row(owner, other);
  }
  std::uint64_t beyond_row(std::uint32_t owner, std::uint32_t other) const {
    return more_.empty() || has_more_[owner] == 0 ? 0 : among_more(owner, other);
  }
  std::uint64_t among_more(std::uint32_t owner, std::uint32_t other) const;

  class Places;
  void list_vertex(const Scene& scene, const Places& places, std::uint32_t v,
                   std::span<const std::uint8_t> rows);
  void list_around(std::span<const std::uint32_t> places, std::span<const std::uint8_t> rows);
  void finish(std::span<const std::span<const Primitive>> blocks, std::span<const std::uint8_t> rows);
  void add(std::uint32_t owner, std::uint32_t other, std::uint64_t pairs);

  // One row a block: itself, and the blocks after it that it shares vertices with, about five.
  std::vector<std::uint32_t> others_;
  std::vector<std::uint64_t> pairs_;
  std::vector<More> more_;              // entries that did not fit in a row, by owner and other
  std::vector<std::uint8_t> has_more_;  // by owner; empty if none has
  std::vector<std::uint8_t> crowded_;   // by block; empty if none is
};

/// Marks the blocks, of the same number of them, that share vertices with others than before: what is known
/// of their neighbours is of others.
void list_changed_rows(const SharedVertices& before, const SharedVertices& now,
                       std::span<std::uint8_t> blocks);

/// Those of a hierarchy of this shape and order; null where it has no blocks. Throws Stopped when told to
/// stop.
std::shared_ptr<const SharedVertices> shared_vertices(const Scene& scene, const TreeShape& shape,
                                                      std::span<const Primitive> order, StopSignal stop = {});
/// The same where `before` is of a hierarchy of as many blocks, of which others are `changed`, by block.
std::shared_ptr<const SharedVertices> shared_vertices(const Scene& scene, const TreeShape& shape,
                                                      std::span<const Primitive> order,
                                                      const SharedVertices& before,
                                                      std::span<const std::uint8_t> changed, StopSignal stop);

}  // namespace warmfront

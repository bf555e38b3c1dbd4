// SPDX-License-Identifier: Apache-2.0
#include "engine/front/neighbours.h"

#include <algorithm>
#include <iterator>
#include <utility>

#include "engine/bvh/node_patches.h"
#include "engine/parallel/stoppable_loops.h"
#include "engine/simd/lanes.h"

namespace warmfront {
namespace {

// Rows of four as columns.
template <class Vector>
struct Columns {
  Vector of[4];

  WARMFRONT_INLINE Columns(Vector a, Vector b, Vector c, Vector d) {
    const Vector ab_low = shuffle<0, 4, 1, 5>(a, b);
    const Vector cd_low = shuffle<0, 4, 1, 5>(c, d);
    const Vector ab_high = shuffle<2, 6, 3, 7>(a, b);
    const Vector cd_high = shuffle<2, 6, 3, 7>(c, d);
    of[0] = shuffle<0, 1, 4, 5>(ab_low, cd_low);
    of[1] = shuffle<2, 3, 6, 7>(ab_low, cd_low);
    of[2] = shuffle<0, 1, 4, 5>(ab_high, cd_high);
    of[3] = shuffle<2, 3, 6, 7>(ab_high, cd_high);
  }
};

// TravelBudget::exhausted() of four pairs, a bit each: the same operations on the same numbers.
WARMFRONT_INLINE std::uint32_t exhausted_of_four(const NeighbourPair* pairs, const NodeTravel* travel,
                                                 std::uint32_t reserve) {
  static_assert(sizeof(TravelBudget) == sizeof(Float4) && sizeof(NodeTravel) == sizeof(Float4));
  Float4 offset[4];  // the fourth lane is none
  UInt4 left[4];     // the fourth lane is what is left of the gap, the others are nothing
  for (int i = 0; i < 4; ++i) {
    const auto a = load<Float4>(&travel[number_of(pairs[i].a)]);
    const auto b = load<Float4>(&travel[number_of(pairs[i].b)]);
    const auto budget = load<Float4>(&pairs[i].budget);
    offset[i] = (a - b) - budget;
    left[i] = (UInt4)budget - (UInt4)a - (UInt4)b;
  }
  const Columns offsets(offset[0], offset[1], offset[2], offset[3]);
  const Columns lefts(left[0], left[1], left[2], left[3]);
  const Float4 usable = __builtin_convertvector((Int4)(lefts.of[3] - reserve), Float4);
  Int4 lasts = Int4{} - 1;
  for (int k = 0; k < 3; ++k) lasts &= (Int4)(magnitude(offsets.of[k]) * travel::kUnits < usable);
  const Int4 bits = ~lasts & Int4{1, 2, 4, 8};
  return static_cast<std::uint32_t>(bits[0] | bits[1] | bits[2] | bits[3]);
}

// The last chunk, which is not among the first `but`, with room for more.
NeighbourChunk& open_chunk(std::vector<NeighbourChunk>& chunks, std::size_t but) {
  if (chunks.size() == but || chunks.back().pairs.size() >= NeighbourChunk::kPairs) chunks.emplace_back();
  return chunks.back();
}

// Two leaves, whose pairs are the chunk's last.
void add_leaves(NeighbourChunk& chunk, const TreeShape& shape, LeafId leaf, LeafId other) {
  chunk.leaves.push_back({leaf, other, static_cast<std::uint32_t>(chunk.pairs.size())});
  chunk.nodes.add(shape.node_of(leaf));
  chunk.nodes.add(shape.node_of(other));
}

// The leaves below a subtree's root, ascending: those of the last level but one, then those of the last.
template <class OfLeaf>
void for_leaves_of(const TreeShape& shape, std::uint32_t subtree, OfLeaf&& of_leaf) {
  const int top = shape.subtree_level();
  for (int level = std::max(shape.levels() - 2, top); level < shape.levels(); ++level) {
    const std::uint32_t width = 1U << (level - top);
    const NodeId first = TreeShape::first_of_level(level) + subtree * width;
    for (NodeId node = first; node < std::min(first + width, shape.end_node()); ++node) {
      if (shape.is_leaf(node)) of_leaf(shape.leaf_of(node));
    }
  }
}

std::size_t bytes_of(std::span<const NeighbourChunk> chunks) {
  std::size_t bytes = 0;
  for (const NeighbourChunk& chunk : chunks) bytes += chunk.list_bytes();
  return bytes;
}

}  // namespace

WARMFRONT_TARGET_CLONES
std::size_t due_neighbours(std::span<const NeighbourPair> pairs, std::span<const NodeTravel> travel,
                           std::uint32_t reserve, std::uint32_t* due) {
  std::size_t count = 0;
  std::uint32_t n = 0;
  for (; n + 4 <= pairs.size(); n += 4) {
    const std::uint32_t exhausted = exhausted_of_four(&pairs[n], travel.data(), reserve);
    for (std::uint32_t i = 0; i < 4; ++i) {
      due[count] = n + i;
      count += (exhausted >> i) & 1;
    }
  }
  for (; n < pairs.size(); ++n) {
    due[count] = n;
    count += pairs[n].budget.exhausted(travel[number_of(pairs[n].a)], travel[number_of(pairs[n].b)], reserve)
                 ? 1
                 : 0;
  }
  return count;
}

template <class Bounds>
std::vector<NeighbourChunk> list_neighbours(const Bvh<Bounds>& tree, StopSignal stop) {
  std::vector<NeighbourChunk> chunks;
  if (tree.travel.blocks.empty() || tree.leaves.shared == nullptr) return chunks;
  std::vector<LeafId> leaf_of(tree.shape.block_count());  // by block
  for (LeafId leaf{0}; leaf < tree.shape.end_leaf(); ++leaf) {
    const BlockRange& blocks = tree.leaves.blocks_of[number_of(leaf)];
    std::fill_n(leaf_of.begin() + number_of(blocks.begin), blocks.size(), leaf);
  }
  const PatchesOfTwo patches(tree.patches, tree.patches);
  const TreeShape& shape = tree.shape;
  // What goes from one subtree to another, behind the subtrees' own: in the order of leaves, too.
  struct Across {
    LeafId leaf, other;
    std::size_t first_pair, end_pair;
  };
  struct OfSubtree {
    NeighbourChunk within;
    std::vector<NeighbourPair> pairs;
    std::vector<Across> across;
  };
  std::vector<OfSubtree> found(shape.subtree_count());
  const auto list_subtree = [&](std::size_t s) {
    const auto subtree = static_cast<std::uint32_t>(s);
    OfSubtree& own = found[s];
    std::vector<NeighbourPair> of_leaf;
    std::vector<LeafId> others;  // the leaves that these reach, ascending
    PacedStop paced(stop, 16);
    const auto list_leaf = [&](LeafId leaf) {
      paced.check();
      of_leaf.clear();
      others.clear();
      const auto [first, end] = tree.leaves.blocks_of[number_of(leaf)];
      for (BlockId a = first; a < end; ++a) {
        tree.leaves.shared->for_neighbours(a, [&](BlockId b) {
          const NodeTravel& of_a = tree.travel.blocks[number_of(a)];
          const NodeTravel& of_b = tree.travel.blocks[number_of(b)];
          of_leaf.push_back({a, b, TravelBudget::grant(of_a, of_b, -1), tree.excluded(a, b)});
          const LeafId other = leaf_of[number_of(b)];
          const auto at = std::ranges::lower_bound(others, other);
          if (at == others.end() || *at != other) others.insert(at, other);
        });
      }
      for (const LeafId other : others) {
        if (patches.are_one(shape.node_of(leaf), shape.node_of(other))) continue;  // as a traversal does
        const bool within = shape.subtree_of(shape.node_of(other)) == subtree;
        std::vector<NeighbourPair>& pairs = within ? own.within.pairs : own.pairs;
        const std::size_t first_pair = pairs.size();
        std::ranges::copy_if(of_leaf, std::back_inserter(pairs),
                             [&](const NeighbourPair& pair) { return leaf_of[number_of(pair.b)] == other; });
        if (within)
          add_leaves(own.within, shape, leaf, other);
        else
          own.across.push_back({leaf, other, first_pair, pairs.size()});
      }
    };
    for_leaves_of(shape, subtree, list_leaf);
    own.within.leaves.shrink_to_fit();
    own.within.pairs.shrink_to_fit();
  };
  for_each_index(0, found.size(), stop, list_subtree, 1);

  std::vector<std::pair<Across, const std::vector<NeighbourPair>*>> across;
  chunks.reserve(found.size());
  for (OfSubtree& own : found) {
    chunks.push_back(std::move(own.within));
    for (const Across& pairs : own.across) across.emplace_back(pairs, &own.pairs);
  }
  std::ranges::stable_sort(across, {}, [](const auto& one) { return one.first.leaf; });
  PacedStop paced(stop, 16);
  for (const auto& [of_two, pairs] : across) {
    paced.check();
    NeighbourChunk& chunk = open_chunk(chunks, found.size());
    chunk.pairs.insert(chunk.pairs.end(), pairs->begin() + static_cast<std::ptrdiff_t>(of_two.first_pair),
                       pairs->begin() + static_cast<std::ptrdiff_t>(of_two.end_pair));
    add_leaves(chunk, shape, of_two.leaf, of_two.other);
  }
  for (std::size_t c = found.size(); c < chunks.size(); ++c) {
    chunks[c].leaves.shrink_to_fit();
    chunks[c].pairs.shrink_to_fit();
  }
  return chunks;
}

template <class Bounds>
bool Neighbours::list(PartId part, const Bvh<Bounds>& tree, std::size_t max_bytes, StopSignal stop) {
  if (number_of(part) >= of_part_.size()) of_part_.resize(number_of(part) + 1);
  OfPart& of = of_part_[number_of(part)];
  if (std::exchange(of.tried, true)) return false;
  std::vector<NeighbourChunk> listed = list_neighbours(tree, stop);
  const std::size_t bytes = list_bytes_ + bytes_of(listed);
  if (bytes > max_bytes) return false;
  list_bytes_ = bytes;
  of.chunks = std::move(listed);
  return !of.chunks.empty();
}

void Neighbours::forget(PartId part) {
  if (number_of(part) >= of_part_.size()) return;
  list_bytes_ -= bytes_of(of_part_[number_of(part)].chunks);
  of_part_[number_of(part)] = {};
}

void Neighbours::clear() {
  std::vector<OfPart>().swap(of_part_);
  list_bytes_ = 0;
}

void Neighbours::forget_answers() {
  for (OfPart& part : of_part_) {
    for (NeighbourChunk& chunk : part.chunks) chunk.at_rest = {};
  }
}

void Neighbours::settle(PartId part, std::span<const NodeTravel> block_travel,
                        std::uint32_t reserve) noexcept {
  for (NeighbourChunk& chunk : of(part)) {
    for (NeighbourPair& pair : chunk.pairs) {
      const NodeTravel& at_a = block_travel[number_of(pair.a)];
      const NodeTravel& at_b = block_travel[number_of(pair.b)];
      if (!pair.budget.exhausted(at_a, at_b, reserve)) continue;
      pair.budget.spend(at_a, at_b);
      chunk.may_have_contacts = true;
      chunk.at_rest.known = false;
    }
  }
}

void Neighbours::leave_trial(PartId part, const TrialTravel& blocks, TrialLeft left,
                             std::uint32_t reserve) noexcept {
  for (NeighbourChunk& chunk : of(part)) {
    for (NeighbourPair& pair : chunk.pairs) {
      if (warmfront::leave_trial(pair.budget, blocks, number_of(pair.a), blocks, number_of(pair.b), left,
                                 reserve))
        continue;
      chunk.may_have_contacts = true;
      chunk.at_rest.known = false;
    }
  }
}

std::size_t Neighbours::pair_bytes() const {
  std::size_t bytes = 0;
  for (const OfPart& part : of_part_) {
    for (const NeighbourChunk& chunk : part.chunks) bytes += chunk.memory_bytes();
  }
  return bytes;
}

std::size_t Neighbours::memory_bytes() const {
  constexpr std::size_t kOfChunk = 32;  // the allocator rounds up, by up to 15 bytes each of two lists
  std::size_t bytes = pair_bytes() + of_part_.capacity() * sizeof(OfPart);
  for (const OfPart& part : of_part_)
    bytes += part.chunks.size() * kOfChunk +
             (part.chunks.capacity() - part.chunks.size()) * sizeof(NeighbourChunk);
  return bytes;
}

template std::vector<NeighbourChunk> list_neighbours(const Bvh<Aabb>&, StopSignal);
template std::vector<NeighbourChunk> list_neighbours(const Bvh<KDop18>&, StopSignal);
template bool Neighbours::list(PartId, const Bvh<Aabb>&, std::size_t, StopSignal);
template bool Neighbours::list(PartId, const Bvh<KDop18>&, std::size_t, StopSignal);

}  // namespace warmfront

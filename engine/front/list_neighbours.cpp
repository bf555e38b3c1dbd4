// SPDX-License-Identifier: Apache-2.0
// Which blocks share a vertex, subtree by subtree.
#include <algorithm>
#include <cstdint>
#include <iterator>
#include <utility>
#include <vector>

#include "engine/bvh/node_patches.h"
#include "engine/front/neighbours.h"
#include "engine/parallel/stoppable_loops.h"

namespace warmfront {
namespace {

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

// What goes from one subtree to another, behind the subtrees' own: in the order of leaves, too.
struct Across {
  LeafId leaf, other;
  std::size_t first_pair, end_pair;
};
struct ListOfSubtree {
  NeighbourChunk within;
  std::vector<NeighbourPair> pairs;
  std::vector<Across> across;
};

template <class Bounds>
class SubtreeLists {
 public:
  explicit SubtreeLists(const Bvh<Bounds>& tree)
      : tree_(tree), patches_(tree.patches, tree.patches), leaf_of_(tree.shape.block_count()) {
    for (LeafId leaf{0}; leaf < tree.shape.end_leaf(); ++leaf) {
      const BlockRange& blocks = tree.leaves.blocks_of[number_of(leaf)];
      std::fill_n(leaf_of_.begin() + number_of(blocks.begin), blocks.size(), leaf);
    }
  }

  void list(std::uint32_t subtree, ListOfSubtree& own, StopSignal stop) const {
    const TreeShape& shape = tree_.shape;
    std::vector<NeighbourPair> of_leaf;
    std::vector<LeafId> others;  // the leaves that these reach, ascending
    PacedStop paced(stop, 16);
    const auto list_leaf = [&](LeafId leaf) {
      paced.check();
      of_leaf.clear();
      others.clear();
      const auto [first, end] = tree_.leaves.blocks_of[number_of(leaf)];
      for (BlockId a = first; a < end; ++a) {
        tree_.leaves.shared->for_neighbours(a, [&](BlockId b) {
          const NodeTravel& of_a = tree_.travel.blocks[number_of(a)];
          const NodeTravel& of_b = tree_.travel.blocks[number_of(b)];
          of_leaf.push_back({a, b, TravelBudget::grant(of_a, of_b, -1), tree_.excluded(a, b)});
          const LeafId other = leaf_of_[number_of(b)];
          const auto at = std::ranges::lower_bound(others, other);
          if (at == others.end() || *at != other) others.insert(at, other);
        });
      }
      for (const LeafId other : others) {
        if (patches_.are_one(shape.node_of(leaf), shape.node_of(other))) continue;  // as a traversal does
        const bool within = shape.subtree_of(shape.node_of(other)) == subtree;
        std::vector<NeighbourPair>& pairs = within ? own.within.pairs : own.pairs;
        const std::size_t first_pair = pairs.size();
        std::ranges::copy_if(of_leaf, std::back_inserter(pairs),
                             [&](const NeighbourPair& pair) { return leaf_of_[number_of(pair.b)] == other; });
        if (within)
          add_leaves(own.within, shape, leaf, other);
        else
          own.across.push_back({leaf, other, first_pair, pairs.size()});
      }
    };
    for_leaves_of(shape, subtree, list_leaf);
    own.within.leaves.shrink_to_fit();
    own.within.pairs.shrink_to_fit();
  }

  bool is_as_it_was(std::uint32_t subtree, std::span<const std::uint8_t> changed_blocks) const {
    bool is = true;
    for_leaves_of(tree_.shape, subtree, [&](LeafId leaf) {
      const auto [first, end] = tree_.leaves.blocks_of[number_of(leaf)];
      for (BlockId a = first; a < end && is; ++a) {
        is = changed_blocks[number_of(a)] == 0;
        tree_.leaves.shared->for_neighbours(a, [&](BlockId b) { is &= changed_blocks[number_of(b)] == 0; });
      }
    });
    return is;
  }

 private:
  const Bvh<Bounds>& tree_;
  const PatchesOfTwo patches_;
  std::vector<LeafId> leaf_of_;  // by block
};

// Of pairs of blocks that have not changed, as they were before: but for filters these come in the same
// order.
void take_budgets(std::vector<NeighbourPair>& pairs, std::span<const NeighbourPair> before,
                  std::span<const std::uint8_t> changed_blocks) {
  const auto stays = [&](const NeighbourPair& pair) {
    return (changed_blocks[number_of(pair.a)] | changed_blocks[number_of(pair.b)]) == 0;
  };
  auto next = before.begin();
  for (NeighbourPair& pair : pairs) {
    if (!stays(pair)) continue;
    const auto is_same = [&](const NeighbourPair& other) { return other.a == pair.a && other.b == pair.b; };
    while (next != before.end() && !stays(*next)) ++next;
    auto at = next;
    if (at == before.end() || !is_same(*at)) at = std::ranges::find_if(before, is_same);
    if (at == before.end()) continue;
    pair.budget = at->budget;
    next = std::next(at);
  }
}

// A chunk for each subtree, then those of what goes across.
std::vector<NeighbourChunk> in_chunks(std::span<ListOfSubtree> found, const TreeShape& shape,
                                      StopSignal stop) {
  std::vector<NeighbourChunk> chunks;
  std::vector<std::pair<Across, const std::vector<NeighbourPair>*>> across;
  chunks.reserve(found.size());
  for (ListOfSubtree& own : found) {
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

}  // namespace

template <class Bounds>
std::vector<NeighbourChunk> list_neighbours(const Bvh<Bounds>& tree, StopSignal stop) {
  if (tree.travel.blocks.empty() || tree.leaves.shared == nullptr) return {};
  const SubtreeLists<Bounds> lists(tree);
  std::vector<ListOfSubtree> found(tree.shape.subtree_count());
  for_each_index(
      0, found.size(), stop,
      [&](std::size_t s) { lists.list(static_cast<std::uint32_t>(s), found[s], stop); }, 1);
  return in_chunks(found, tree.shape, stop);
}

// A subtree is as it was where none of its blocks has changed, nor one that it lists: what it lists of others
// is copied.
template <class Bounds>
std::vector<NeighbourChunk> follow_neighbours(const Bvh<Bounds>& tree, std::vector<NeighbourChunk> before,
                                              std::span<const std::uint8_t> changed_blocks, StopSignal stop) {
  const SubtreeLists<Bounds> lists(tree);
  std::vector<ListOfSubtree> found(tree.shape.subtree_count());
  std::vector<ListOfSubtree> held(found.size());  // as before
  PacedStop paced(stop, 16);
  for (const NeighbourChunk& chunk : std::span(before).subspan(found.size())) {
    std::size_t first = 0;
    for (const NeighbourChunk::Leaves& leaves : chunk.leaves) {
      paced.check();
      ListOfSubtree& own = held[tree.shape.subtree_of(tree.shape.node_of(leaves.a))];
      const std::size_t at = own.pairs.size();
      own.pairs.insert(own.pairs.end(), chunk.pairs.begin() + static_cast<std::ptrdiff_t>(first),
                       chunk.pairs.begin() + leaves.end);
      own.across.push_back({leaves.a, leaves.b, at, own.pairs.size()});
      first = leaves.end;
    }
  }
  for_each_index(
      0, found.size(), stop,
      [&](std::size_t s) {
        if (lists.is_as_it_was(static_cast<std::uint32_t>(s), changed_blocks)) {
          found[s] = std::move(held[s]);
          found[s].within = std::move(before[s]);
          return;
        }
        lists.list(static_cast<std::uint32_t>(s), found[s], stop);
        take_budgets(found[s].within.pairs, before[s].pairs, changed_blocks);
        take_budgets(found[s].pairs, held[s].pairs, changed_blocks);
      },
      1);
  return in_chunks(found, tree.shape, stop);
}

template std::vector<NeighbourChunk> list_neighbours(const Bvh<Aabb>&, StopSignal);
template std::vector<NeighbourChunk> list_neighbours(const Bvh<KDop18>&, StopSignal);
template std::vector<NeighbourChunk> follow_neighbours(const Bvh<Aabb>&, std::vector<NeighbourChunk>,
                                                       std::span<const std::uint8_t>, StopSignal);
template std::vector<NeighbourChunk> follow_neighbours(const Bvh<KDop18>&, std::vector<NeighbourChunk>,
                                                       std::span<const std::uint8_t>, StopSignal);

}  // namespace warmfront

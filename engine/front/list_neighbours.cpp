// SPDX-License-Identifier: Apache-2.0
// Which blocks share a vertex, subtree by subtree.
#include <algorithm>
#include <cstdint>
#include <numeric>
#include <span>
#include <utility>
#include <vector>

#include "engine/bvh/node_patches.h"
#include "engine/front/neighbours.h"
#include "engine/parallel/stoppable_loops.h"

namespace warmfront {
namespace {

// Two leaves, whose pairs are the chunk's last.
void add_leaves(NeighbourChunk& chunk, const TreeShape& shape, LeafId leaf, LeafId other) {
  chunk.leaves.push_back({leaf, other, static_cast<std::uint32_t>(chunk.pairs.size())});
  chunk.nodes.add(shape.node_of(leaf));
  chunk.nodes.add(shape.node_of(other));
}

// What goes from one leaf to others, one after another.
struct LeafRun {
  std::span<const NeighbourChunk::Leaves> leaves;
  std::span<const NeighbourPair> pairs;
  std::uint32_t first_pair;  // that `end` of the leaves count from

  LeafId leaf() const { return leaves.front().a; }
};
// Those of a chunk.
template <class Visit>
void for_runs(const NeighbourChunk& chunk, Visit&& visit) {
  const std::span<const NeighbourChunk::Leaves> all(chunk.leaves);
  std::uint32_t first_pair = 0;
  for (std::size_t first = 0, end = 0; first < all.size(); first = end) {
    while (end < all.size() && all[end].a == all[first].a) ++end;
    const std::uint32_t end_pair = all[end - 1].end;
    visit(LeafRun{all.subspan(first, end - first),
                  std::span(chunk.pairs).subspan(first_pair, end_pair - first_pair), first_pair});
    first_pair = end_pair;
  }
}
// A run becomes the chunk's last.
void append(NeighbourChunk& chunk, const TreeShape& shape, const LeafRun& run) {
  const auto at = static_cast<std::uint32_t>(chunk.pairs.size());
  chunk.pairs.insert(chunk.pairs.end(), run.pairs.begin(), run.pairs.end());
  for (NeighbourChunk::Leaves leaves : run.leaves) {
    leaves.end = at + (leaves.end - run.first_pair);
    chunk.leaves.push_back(leaves);
    chunk.nodes.add(shape.node_of(leaves.a));
    chunk.nodes.add(shape.node_of(leaves.b));
  }
}
// A chunk of these, with no room for more.
NeighbourChunk chunk_of(std::span<const LeafRun> runs, const TreeShape& shape) {
  std::size_t leaves = 0, pairs = 0;
  for (const LeafRun& run : runs) {
    leaves += run.leaves.size();
    pairs += run.pairs.size();
  }
  NeighbourChunk chunk;
  chunk.leaves.reserve(leaves);
  chunk.pairs.reserve(pairs);
  for (const LeafRun& run : runs) append(chunk, shape, run);
  return chunk;
}
void shrink(NeighbourChunk& chunk) {
  chunk.leaves.shrink_to_fit();
  chunk.pairs.shrink_to_fit();
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

// What goes from leaves of a subtree to its own, and to those of others.
struct ListOfLeaves {
  NeighbourChunk within;
  NeighbourChunk across;
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

  void list(std::uint32_t subtree, ListOfLeaves& own, StopSignal stop) const {
    Buffers buffers;
    PacedStop paced(stop, 16);
    for_leaves_of(tree_.shape, subtree, [&](LeafId leaf) {
      paced.check();
      list_leaf(leaf, own, buffers);
    });
    shrink(own.within);
  }

  struct Buffers {
    struct ToLeaf {
      NeighbourPair pair;
      LeafId other;  // of block b
    };
    std::vector<ToLeaf> of_leaf;
    std::vector<LeafId> others;  // the leaves that these reach, ascending
  };
  void list_leaf(LeafId leaf, ListOfLeaves& own, Buffers& buffers) const {
    const TreeShape& shape = tree_.shape;
    auto& [of_leaf, others] = buffers;
    of_leaf.clear();
    others.clear();
    const auto [first, end] = tree_.leaves.blocks_of[number_of(leaf)];
    for (BlockId a = first; a < end; ++a) {
      tree_.leaves.shared->for_neighbours(a, [&, a, &of_leaf = of_leaf, &others = others](BlockId b) {
        const NodeTravel& of_a = tree_.travel.blocks[number_of(a)];
        const NodeTravel& of_b = tree_.travel.blocks[number_of(b)];
        const LeafId other = leaf_of_[number_of(b)];
        of_leaf.push_back({{a, b, TravelBudget::grant(of_a, of_b, -1), tree_.excluded(a, b)}, other});
        const auto at = std::ranges::lower_bound(others, other);
        if (at == others.end() || *at != other) others.insert(at, other);
      });
    }
    const std::uint32_t subtree = shape.subtree_of(shape.node_of(leaf));
    for (const LeafId other : others) {
      if (patches_.are_one(shape.node_of(leaf), shape.node_of(other))) continue;  // as a traversal does
      const bool within = shape.subtree_of(shape.node_of(other)) == subtree;
      NeighbourChunk& chunk = within ? own.within : own.across;
      for (const auto& [pair, leaf_of_b] : of_leaf)
        if (leaf_of_b == other) chunk.pairs.push_back(pair);
      add_leaves(chunk, shape, leaf, other);
    }
  }

  // The leaves with a block that has changed, or that lists one.
  std::vector<LeafId> leaves_of(std::span<const std::uint8_t> changed_blocks, StopSignal stop) const {
    std::vector<LeafId> leaves;
    PacedStop paced(stop, 256);
    for (BlockId a{0}; a < tree_.shape.end_block(); ++a) {
      paced.check();
      const LeafId leaf = leaf_of_[number_of(a)];
      if (!leaves.empty() && leaves.back() == leaf) continue;
      std::uint8_t changed = changed_blocks[number_of(a)];
      tree_.leaves.shared->for_neighbours(a, [&](BlockId b) { changed |= changed_blocks[number_of(b)]; });
      if (changed != 0) leaves.push_back(leaf);
    }
    return leaves;
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

// Of leaves that have changed: what they list now.
class ChangedLeaves {
 public:
  template <class Bounds>
  ChangedLeaves(const SubtreeLists<Bounds>& lists, std::span<const std::uint8_t> changed_blocks,
                StopSignal stop)
      : changed_blocks_(changed_blocks),
        leaves_(lists.leaves_of(changed_blocks, stop)),
        found_(leaves_.size()) {
    std::ranges::sort(leaves_);
    for_each_index(0, found_.size(), stop, [&](std::size_t i) {
      typename SubtreeLists<Bounds>::Buffers buffers;
      lists.list_leaf(leaves_[i], found_[i], buffers);
    });
  }

  // Of some of them, as numbers of theirs in their order: what they list instead of their runs, all by leaf.
  template <class Visit>
  void replace(std::span<const LeafRun> runs, std::span<const std::uint32_t> some, bool within,
               Visit&& visit) {
    auto run = runs.begin();
    for (const std::uint32_t i : some) {
      for (; run != runs.end() && run->leaf() < leaves_[i]; ++run) visit(*run);
      NeighbourChunk& now = within ? found_[i].within : found_[i].across;
      if (run != runs.end() && run->leaf() == leaves_[i])
        take_budgets(now.pairs, (run++)->pairs, changed_blocks_);
      for_runs(now, visit);
    }
    for (; run != runs.end(); ++run) visit(*run);
  }

  std::vector<std::uint32_t> all() const {
    std::vector<std::uint32_t> all(leaves_.size());
    std::iota(all.begin(), all.end(), 0U);
    return all;
  }
  // By subtree.
  std::vector<std::vector<std::uint32_t>> of_subtrees(const TreeShape& shape) const {
    std::vector<std::vector<std::uint32_t>> of(shape.subtree_count());
    for (std::uint32_t i = 0; i < leaves_.size(); ++i)
      of[shape.subtree_of(shape.node_of(leaves_[i]))].push_back(i);
    return of;
  }

 private:
  std::span<const std::uint8_t> changed_blocks_;
  std::vector<LeafId> leaves_;  // ascending
  std::vector<ListOfLeaves> found_;
};

// Where the runs of each chunk end: it is full with the first that reaches NeighbourChunk::kPairs.
std::vector<std::size_t> chunk_ends(std::span<const LeafRun> runs) {
  std::vector<std::size_t> ends;
  std::size_t pairs = 0;
  for (std::size_t i = 0; i < runs.size(); ++i) {
    pairs += runs[i].pairs.size();
    if (pairs < NeighbourChunk::kPairs && i + 1 < runs.size()) continue;
    ends.push_back(i + 1);
    pairs = 0;
  }
  return ends;
}

// Runs of leaves that go across, by leaf, behind the subtrees' own chunks.
void put_across(std::vector<NeighbourChunk>& chunks, const TreeShape& shape, std::span<const LeafRun> runs,
                StopSignal stop) {
  const std::size_t subtrees = chunks.size();
  const std::vector<std::size_t> ends = chunk_ends(runs);
  chunks.resize(subtrees + ends.size());
  for_each_index(
      0, ends.size(), stop,
      [&](std::size_t c) {
        const std::size_t first = c == 0 ? 0 : ends[c - 1];
        chunks[subtrees + c] = chunk_of(runs.subspan(first, ends[c] - first), shape);
      },
      1);
}

}  // namespace

// A chunk for each subtree, then those of what goes across.
template <class Bounds>
std::vector<NeighbourChunk> list_neighbours(const Bvh<Bounds>& tree, StopSignal stop) {
  if (tree.travel.blocks.empty() || tree.leaves.shared == nullptr) return {};
  const SubtreeLists<Bounds> lists(tree);
  std::vector<ListOfLeaves> found(tree.shape.subtree_count());
  std::vector<NeighbourChunk> chunks(found.size());
  std::vector<LeafRun> across(tree.shape.leaf_count());  // by leaf: each has one at most
  for_each_index(
      0, found.size(), stop,
      [&](std::size_t s) {
        lists.list(static_cast<std::uint32_t>(s), found[s], stop);
        chunks[s] = std::move(found[s].within);
        for_runs(found[s].across, [&](const LeafRun& run) { across[number_of(run.leaf())] = run; });
      },
      1);
  std::erase_if(across, [](const LeafRun& run) { return run.leaves.empty(); });
  put_across(chunks, tree.shape, across, stop);
  return chunks;
}

// Leaves are as they were where none of their blocks has changed, nor one that these list, and subtrees where
// all of their leaves are: what these list of their own is not even copied.
template <class Bounds>
std::vector<NeighbourChunk> follow_neighbours(const Bvh<Bounds>& tree, std::vector<NeighbourChunk> before,
                                              std::span<const std::uint8_t> changed_blocks, StopSignal stop) {
  const TreeShape& shape = tree.shape;
  ChangedLeaves changed(SubtreeLists<Bounds>(tree), changed_blocks, stop);
  const std::vector<std::vector<std::uint32_t>> of_subtrees = changed.of_subtrees(shape);
  std::vector<NeighbourChunk> chunks(of_subtrees.size());
  for_each_index(
      0, chunks.size(), stop,
      [&](std::size_t s) {
        if (of_subtrees[s].empty()) {
          chunks[s] = std::move(before[s]);
          return;
        }
        std::vector<LeafRun> were, are;
        for_runs(before[s], [&](const LeafRun& run) { were.push_back(run); });
        changed.replace(were, of_subtrees[s], true, [&](const LeafRun& run) { are.push_back(run); });
        chunks[s] = chunk_of(are, shape);
      },
      1);
  std::vector<LeafRun> were;
  std::vector<LeafRun> are;
  for (const NeighbourChunk& chunk : std::span(before).subspan(chunks.size()))
    for_runs(chunk, [&](const LeafRun& run) { were.push_back(run); });
  changed.replace(were, changed.all(), false, [&](const LeafRun& run) { are.push_back(run); });
  put_across(chunks, shape, are, stop);
  return chunks;
}

template std::vector<NeighbourChunk> list_neighbours(const Bvh<Aabb>&, StopSignal);
template std::vector<NeighbourChunk> list_neighbours(const Bvh<KDop18>&, StopSignal);
template std::vector<NeighbourChunk> follow_neighbours(const Bvh<Aabb>&, std::vector<NeighbourChunk>,
                                                       std::span<const std::uint8_t>, StopSignal);
template std::vector<NeighbourChunk> follow_neighbours(const Bvh<KDop18>&, std::vector<NeighbourChunk>,
                                                       std::span<const std::uint8_t>, StopSignal);

}  // namespace warmfront

// SPDX-License-Identifier: Apache-2.0
// One thread's sink of what the front finds: opens leaf pairs and neighbours into blocks, and these into
// primitive pairs.
#pragma once

#include <algorithm>
#include <atomic>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "engine/front/leaf_pairs.h"
#include "engine/narrow_phase/block_pairs.h"
#include "engine/narrow_phase/narrow_phase.h"
#include "engine/narrow_phase/pair_tester.h"
#include "engine/parallel/fork_within.h"
#include "engine/scene/adjacency.h"
#include "engine/scene/held_bytes.h"
#include "engine/stop.h"

namespace warmfront {

template <class Bounds>
class LeafPairTester;

/// Gives each thread its own. Thread-safe.
template <class Bounds>
class LeafPairTesters {
 public:
  virtual LeafPairTester<Bounds>& local_tester() = 0;

 protected:
  ~LeafPairTesters() = default;
};

/// Opens leaf pairs into primitive pairs.
template <class Bounds>
class LeafPairTester final : public LeafPairSink {
  using Blocks = BlockPairs<Bounds>;

 public:
  /// `testers`: those of all threads.
  void begin(std::span<const Bvh<Bounds>> trees, const NarrowPhaseInput& input, NarrowPhaseShared& shared,
             LeafPairTesters<Bounds>& testers, std::uint64_t step) {
    if (step_ == step) return;
    step_ = step;
    testers_ = &testers;
    trees_ = trees;
    scene_ = &input.scene;
    stop_ = input.stop;
    gap_at_ = input.gap_at;
    widths_ = input.widths;
    tester.begin(input, shared);
    blocks_.begin(input);
  }

  LeafGap leaf_pair(const PartPair& parts, const NodePair& leaves, const LeafBlocks& which) override {
    // One pair of the front may be all the work there is, when what was far apart comes together.
    stop_.check();
    tester.begin_leaves(parts.a, parts.b);
    const Bvh<Bounds>& a = trees_[number_of(parts.a)];
    const Bvh<Bounds>& b = trees_[number_of(parts.b)];
    const bool same = parts.a == parts.b && leaves.a == leaves.b;
    // Adjacent primitives never come apart and are never tested here.
    constexpr float kFar = std::numeric_limits<float>::max();
    if (a.leaves.blocks.empty()) {  // one primitive, whose bounds are the leaf's and were just tested
      if (same) return {kFar, true};
      const Primitive p = a.order[a.shape.begin(leaves.a)];
      const Primitive q = b.order[b.shape.begin(leaves.b)];
      if (adjacent(primitive_vertices(*scene_, p), primitive_vertices(*scene_, q))) return {kFar, true};
      tester.primitive_pair(p, q);
      return {-1, false};
    }
    const std::uint32_t leaf_a = number_of(a.shape.leaf_of(leaves.a));
    const std::uint32_t leaf_b = number_of(b.shape.leaf_of(leaves.b));
    const BlockRange blocks_a = a.leaves.blocks_of[leaf_a];
    const BlockRange blocks_b = b.leaves.blocks_of[leaf_b];
    const Width width = widths_.of(parts);
    const GridPair<Bounds> between = relate(a.leaves.grids[leaf_a], b.leaves.grids[leaf_b], width);
    const OneOfLeaf whole_b = OneOfLeaf::of(b.leaves.grids[leaf_b]);
    blocks_.begin_leaves(a, b, between, width);
    if (blocks_a.size() == 1 && blocks_b.size() == 1 && !which.skip_neighbours) {
      if ((which.among & 1) == 0) return {kFar, false};
      const std::uint64_t excluded = Blocks::excluded(a, blocks_a.begin, b, blocks_b.begin);
      return {blocks_.test(a, blocks_a.begin, b, blocks_b.begin, excluded, same ? nullptr : &whole_b),
              excluded != 0};
    }
    const EightBounds<Bounds>& wide_b = b.leaves.wide[leaf_b];
    const EightOverlaps pairs =
        block_overlaps(a.leaves.wide[leaf_a], wide_b, {blocks_a.size(), blocks_b.size(), same}, between,
                       whole_b, tester.until(), gap_at_);
    const std::uint64_t near = transposed(pairs.to_test) & which.among;
    LeafGap nearest{pairs.gap, false};
    if (which.skip_neighbours)
      nearest.neighbours = neighbours_among(near, which, a, blocks_a.begin, blocks_b.begin);
    nearest.adjacent = nearest.neighbours != 0;
    const std::uint64_t before = triangle_pairs();
    // By blocks of a, so that each is brought over once.
    for (std::uint64_t bits = near & ~nearest.neighbours; bits != 0; bits &= bits - 1) {
      if (triangle_pairs() - before >= which.at_once) {
        nearest.left = bits;
        break;
      }
      const auto bit = static_cast<std::uint32_t>(std::countr_zero(bits));
      const std::uint32_t i = bit / 8;
      const std::uint32_t j = bit % 8;
      const OneOfLeaf block = OneOfLeaf::of(wide_b, between.begin_at_1_of_b, j);
      const BlockId block_a = blocks_a.begin + i;
      const BlockId block_b = blocks_b.begin + j;
      const std::uint64_t excluded = which.skip_neighbours ? a.excluded_if_not_listed(block_a, block_b)
                                                           : Blocks::excluded(a, block_a, b, block_b);
      const float gap = blocks_.test(a, block_a, b, block_b, excluded, same && i == j ? nullptr : &block);
      nearest.gap = std::min(nearest.gap, gap);
      nearest.adjacent |= excluded != 0;
    }
    return nearest;
  }

  LeafGap leaf_pair_at_rest(const PartPair& parts, const NodePair& leaves, const LeafBlocks& which,
                            RestAnswer& answer) override {
    LeafGap gap{};
    tester.recording(answer, [&] { gap = leaf_pair(parts, leaves, which); });
    return gap;
  }

  void neighbours(PartId part, NeighbourChunk& chunk) override {
    find_due(part, chunk);
    if (due_.size() < 2 * kOneTask || !among_many_threads()) {
      chunk.may_have_contacts = test_due(part, chunk, due_);
      return;
    }
    std::atomic<bool> may_have_contacts = false;
    const std::size_t tasks = due_.size() / kOneTask;
    fork_within(std::size_t{0}, tasks, [&](std::size_t task) {
      LeafPairTester& here = testers_->local_tester();
      const StageClock::In front(here.tester.clock(), Stage::kFront);
      const std::size_t begin = task * due_.size() / tasks;
      const std::size_t end = (task + 1) * due_.size() / tasks;
      if (here.test_due(part, chunk, std::span(due_).subspan(begin, end - begin)))
        may_have_contacts.store(true, std::memory_order_relaxed);
    });
    chunk.may_have_contacts = may_have_contacts;
  }

  void neighbours_at_rest(PartId part, NeighbourChunk& chunk) override {
    NeighbourChunk::AtRest& found = chunk.at_rest;
    found.answer.clear();
    // What is recorded is this thread's alone.
    tester.recording(found.answer, [&] {
      find_due(part, chunk);
      chunk.may_have_contacts = test_due(part, chunk, due_);
    });
    found.known = true;
  }

  void keep(std::uint64_t triangle_pairs, const ContactTally& tally,
            std::span<const Contact> contacts) override {
    tester.note_kept(triangle_pairs, tally, contacts);
    tester.output().counts.triangle_pairs += triangle_pairs;
    tester.keep(tally);
    for (const Contact& contact : contacts) tester.keep(contact);
  }

  std::uint64_t triangle_pairs() const override { return tester.output().counts.triangle_pairs; }

  std::size_t memory_bytes() const {
    return sizeof(*this) - sizeof(tester) + tester.memory_bytes() + held_bytes(due_);
  }

  PairTester tester;

 private:
  /// Pairs of neighbours that are worth a task of their own: some 2 us, and 10 where they are near.
  static constexpr std::size_t kOneTask = 16;

  void find_due(PartId part, const NeighbourChunk& chunk) {
    const TreeTravel& travel = trees_[number_of(part)].travel;
    const std::uint32_t reserve = travel::reserve(2 * travel.slack, widths_.of({part, part}));
    due_.resize(chunk.pairs.size());
    due_.resize(due_neighbours(chunk.pairs, travel.blocks, reserve, due_.data()));
  }

  // Tests these of a chunk's pairs, in ascending order; returns whether there may be something to tell of
  // one.
  bool test_due(PartId part, NeighbourChunk& chunk, std::span<const std::uint32_t> due) {
    if (due.empty()) return false;
    tester.begin_leaves(part, part);
    const Bvh<Bounds>& tree = trees_[number_of(part)];
    const std::span<const NodeTravel> granted_at = tree.travel.blocks_at(gap_at_);
    const Width width = widths_.of({part, part});
    bool may_have_contacts = false;
    auto leaves = std::ranges::upper_bound(chunk.leaves, due.front(), {}, &NeighbourChunk::Leaves::end);
    for (std::size_t i = 0; i < due.size(); ++leaves) {
      if (due[i] >= leaves->end) continue;
      stop_.check();
      const GridPair<Bounds> between =
          relate(tree.leaves.grids[number_of(leaves->a)], tree.leaves.grids[number_of(leaves->b)], width);
      const EightBounds<Bounds>& wide_b = tree.leaves.wide[number_of(leaves->b)];
      const BlockId first_b = tree.leaves.blocks_of[number_of(leaves->b)].begin;
      blocks_.begin_leaves(tree, tree, between, width);
      for (; i < due.size() && due[i] < leaves->end; ++i) {
        // What is due lies anywhere: it is asked for some pairs ahead.
        constexpr std::size_t kAhead = 4;
        if (due.size() - i > kAhead) prefetch(tree, chunk.pairs[due[i + kAhead]]);
        NeighbourPair& pair = chunk.pairs[due[i]];
        const OneOfLeaf whole_b = OneOfLeaf::of(wide_b, between.begin_at_1_of_b, pair.b - first_b);
        const float gap =
            blocks_.test(tree, pair.a, tree, pair.b, pair.excluded, pair.a == pair.b ? nullptr : &whole_b);
        pair.budget = TravelBudget::grant(granted_at[number_of(pair.a)], granted_at[number_of(pair.b)], gap);
        may_have_contacts |= !(gap > width.straight);
      }
    }
    return may_have_contacts;
  }

  GridPair<Bounds> relate(const LeafGrid<Bounds>& a, const LeafGrid<Bounds>& b, const Width& width) const {
    GridPair<Bounds> between = grid_pair(a, b, width);
    if (tester.until() < 1) between.learn_end(a, b, width);
    return between;
  }

  // Those of the near blocks that are listed as neighbours: as they share a vertex, all that are.
  static std::uint64_t neighbours_among(std::uint64_t near, const LeafBlocks& which, const Bvh<Bounds>& tree,
                                        BlockId first_a, BlockId first_b) {
    if (which.neighbours != 0) return which.neighbours;
    std::uint64_t neighbours = 0;
    for (std::uint64_t bits = near; bits != 0; bits &= bits - 1) {
      const auto bit = static_cast<std::uint32_t>(std::countr_zero(bits));
      if (tree.leaves.shared->has_place(first_a + bit / 8, first_b + bit % 8)) neighbours |= bits & -bits;
    }
    return neighbours;
  }

  static void prefetch(const Bvh<Bounds>& tree, const NeighbourPair& pair) {
    prefetch(tree.leaves.blocks[number_of(pair.a)]);
    if (pair.b != pair.a) prefetch(tree.leaves.blocks[number_of(pair.b)]);
  }
  static void prefetch(const EightBounds<Bounds>& eight) {
    constexpr std::size_t kRowsInALine = 2;
    for (std::size_t row = 0; row < eight.kRows; row += kRowsInALine)
      __builtin_prefetch(eight.row[row].data());
  }

  LeafPairTesters<Bounds>* testers_ = nullptr;
  std::span<const Bvh<Bounds>> trees_;
  const Scene* scene_ = nullptr;
  StopSignal stop_;
  GapAt gap_at_ = GapAt::kEnd;
  PartWidths widths_;
  std::uint64_t step_ = 0;
  Blocks blocks_{tester};
  std::vector<std::uint32_t> due_;
};

}  // namespace warmfront

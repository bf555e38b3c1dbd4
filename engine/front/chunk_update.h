// SPDX-License-Identifier: Apache-2.0
// Building and updating one chunk of the front. Used by one thread at a time.
// Source: Tang, Manocha, Tong 2009, section 4.3 (sprouting); pruning as in Ehmann, Lin 2001, made canonical.
#pragma once

#include <cstdint>
#include <utility>

#include "engine/front/front.h"
#include "engine/front/pending_leaves.h"

namespace warmfront {

/// A thread's room for the chunk that it works on, and its counts.
struct ChunkScratch {
  std::vector<FrontPair> pairs;
  std::size_t counted = 0;  ///< of these, in the step's room
  KeptAnswers kept;
  RestAnswer found;  ///< of the leaf pair in hand
  PendingLeaves pending;
  FrontCounts counts;

  void clear() {
    pairs.clear();
    counted = 0;
    kept.clear();
    found.clear();
  }
  /// Gives back what one large chunk needed.
  void trim() {
    constexpr std::size_t kMostPairs = std::size_t{1} << 14;
    constexpr std::size_t kMostContacts = std::size_t{1} << 14;
    if (pairs.capacity() > kMostPairs) std::vector<FrontPair>().swap(pairs);
    if (kept.contacts.capacity() > kMostContacts) kept = {};
  }
};

/// Reads the answers of a chunk's pairs, asked for in ascending order.
class KeptReader {
 public:
  explicit KeptReader(const KeptAnswers& kept) : kept_(kept) {}

  /// Null when there are none.
  const KeptAnswers::OfPair* of(std::uint32_t pair) {
    for (; at_ < kept_.pairs.size() && kept_.pairs[at_].pair < pair; ++at_)
      first_ += kept_.pairs[at_].contacts;
    return at_ < kept_.pairs.size() && kept_.pairs[at_].pair == pair ? &kept_.pairs[at_] : nullptr;
  }
  /// Of the pair last asked for, which has some answers.
  std::span<const Contact> contacts() const {
    return std::span(kept_.contacts).subspan(first_, kept_.pairs[at_].contacts);
  }

 private:
  const KeptAnswers& kept_;
  std::size_t at_ = 0;
  std::size_t first_ = 0;
};

template <class Bounds>
class ChunkUpdate {
 public:
  ChunkUpdate(const TreePair<Bounds>& trees, const PartPair& parts, bool skip_neighbours,
              LeafPairSinks& sinks, const FrontUpdate& how, Answers answers, FrontRoom& room,
              ChunkScratch& scratch)
      : trees_(trees),
        bvtt_(trees.bvtt()),
        parts_(parts),
        skip_neighbours_(skip_neighbours),
        sinks_(sinks),
        sink_(sinks.local()),
        how_(how),
        fold_width_(how.fold_widths.of(parts)),
        answers_(answers),
        room_(room),
        scratch_(scratch),
        counts_(scratch.counts) {
    scratch_.clear();
    scratch_.pending.begin(sink_);
  }

  /// Traverses from a pair whose gap is known; the front's pairs below it are in the scratch then, as far as
  /// there is room.
  void build(const NodePair& from, float gap) {
    sprout(from, gap);
    test_pending();
  }

  /// Updates the pairs of a chunk, in order: overlapping ones are opened (leaf pairs handed over); with
  /// prune, disjoint ones are folded as far as their ancestors are disjoint, else kept. Returns whether the
  /// pairs changed and are in the scratch now; else they are where they were, with new budgets. The kept
  /// contacts are in the scratch either way.
  bool run(FrontChunk& chunk) {
    const std::uint64_t tests = counts_.bv_tests;
    const std::uint64_t found = sink_.triangle_pairs();
    KeptReader kept(chunk.kept);
    pairs_ = &chunk.pairs;
    for (std::size_t i = 0; i < chunk.pairs.size(); ++i) {
      switch (action_of(chunk.pairs[i], trees_, how_.lazy, how_.wider, answers_)) {
        case PairAction::kReuse:
          ++counts_.rested;
          if (const KeptAnswers::OfPair* answers = kept.of(static_cast<std::uint32_t>(i))) {
            sink_.keep(answers->triangle_pairs, answers->tally, kept.contacts());
            put_kept(place(i), answers->triangle_pairs, answers->tally, kept.contacts());
          }
          keep_or_fold(chunk, i);
          break;
        case PairAction::kSkip:
          ++counts_.skipped;
          keep_or_fold(chunk, i);
          break;
        case PairAction::kTest:
          test(chunk, i);
          break;
      }
    }
    test_pending();
    cost_ = kOfPair * chunk.pairs.size() + (counts_.bv_tests - tests) + kOfLeaves * leaf_pairs_ +
            kOfTrianglePair * (sink_.triangle_pairs() - found);
    return changed();
  }
  /// What that took, in tests of two nodes, about.
  std::uint64_t cost() const { return cost_; }

 private:
  /// What each takes: by a fit to what chunks of cloth-ball take in the next step.
  static constexpr std::uint64_t kOfPair = 2, kOfLeaves = 4, kOfTrianglePair = 14;

  void test(FrontChunk& chunk, std::size_t i) {
    FrontPair& pair = chunk.pairs[i];
    const float gap = pair.adjacent ? -1 : trees_.gap(pair.nodes, counts_.bv_tests);
    if (gap > 0) {
      pair.budget = grant(pair.nodes, gap);
      keep_or_fold(chunk, i);
    } else if (bvtt_.is_leaf(pair.nodes)) {
      const std::uint32_t at = place(i);
      keep(chunk, i);
      test_leaves(pair.nodes, pair.neighbours, at);
    } else {
      ++counts_.sprouted;
      change(chunk, i);
      sprout(pair.nodes, gap);
    }
  }

  TravelBudget grant(const NodePair& pair, float gap) const { return grant_budget(trees_, pair, gap); }

  void sprout(const NodePair& from, float gap) {
    descend(
        trees_, from, gap, counts_.bv_tests,
        [this](const NodePair& pair, float apart) {
          push({pair, grant(pair, apart)});
        },
        [this](const NodePair& pair) {
          const auto at = static_cast<std::uint32_t>(scratch_.pairs.size());
          push({pair, {}});
          test_leaves(pair, 0, at);
        });
  }

  // A front for which there is no room is lost: no more is written then.
  void push(const FrontPair& pair) {
    constexpr std::size_t kBlock = 256;
    paced_.check();
    if (scratch_.pairs.size() >= scratch_.counted + kBlock) {
      const std::size_t more = scratch_.pairs.size() - std::exchange(scratch_.counted, scratch_.pairs.size());
      room_.take_pairs(more);
    }
    if (!room_.pairs_lost()) scratch_.pairs.push_back(pair);
  }

  // Tests the leaves of the pair at this place: at once where the answer is kept, else with others.
  void test_leaves(const NodePair& leaves, std::uint64_t neighbours, std::uint32_t at) {
    const bool at_rest = answers_ != Answers::kForget && (trees_.state(leaves) & kMoving) == 0;
    if (!at_rest) {
      ++leaf_pairs_;
      scratch_.pending.add({leaves, at, neighbours});
      if (scratch_.pending.full()) test_pending();
      return;
    }
    const LeafGap learnt =
        sink_.leaf_pair_at_rest(parts_, leaves, {skip_neighbours_, neighbours}, scratch_.found);
    keep_found(at);
    learn(leaves, at, learnt);
  }
  void test_pending() {
    scratch_.pending.test(parts_, skip_neighbours_, trees_.a.shape.has_wide_leaves(), sink_, sinks_,
                          [this](const PendingLeaves::Pair& tested, const LeafGap& learnt) {
                            learn(tested.leaves, tested.place, learnt);
                          });
  }
  void learn(const NodePair& leaves, std::uint32_t at, const LeafGap& learnt) {
    if (at >= pairs_->size()) return;  // there was no room for it
    FrontPair& pair = (*pairs_)[at];
    pair.budget = grant(leaves, learnt.gap);
    pair.adjacent = learnt.adjacent;
    pair.neighbours = learnt.neighbours;
  }

  // What was just found belongs to the pair at this place.
  void keep_found(std::uint32_t at) {
    const RestAnswer& found = scratch_.found;
    // Of one pair of leaves.
    const auto triangle_pairs = static_cast<std::uint32_t>(found.triangle_pairs);
    if (!found.empty()) put_kept(at, triangle_pairs, found.tally, found.contacts);
    scratch_.found.clear();
  }
  void put_kept(std::uint32_t at, std::uint32_t triangle_pairs, const ContactTally& tally,
                std::span<const Contact> contacts) {
    if (!room_.take_answers(sizeof(KeptAnswers::OfPair) + contacts.size_bytes())) return;
    scratch_.kept.pairs.push_back({at, triangle_pairs, static_cast<std::uint32_t>(contacts.size()), tally});
    scratch_.kept.contacts.insert(scratch_.kept.contacts.end(), contacts.begin(), contacts.end());
  }

  // Are the chunk's pairs written anew?
  bool changed() const { return pairs_ == &scratch_.pairs; }
  // Where pair i of the chunk will be.
  std::uint32_t place(std::size_t i) const {
    return static_cast<std::uint32_t>(changed() ? scratch_.pairs.size() : i);
  }

  // From here on the chunk's pairs go to the scratch, those before pair i first.
  void change(const FrontChunk& chunk, std::size_t i) {
    if (changed()) return;
    pairs_ = &scratch_.pairs;
    scratch_.pairs.assign(chunk.pairs.begin(), chunk.pairs.begin() + static_cast<std::ptrdiff_t>(i));
  }

  void keep(const FrontChunk& chunk, std::size_t i) {
    if (changed()) push(chunk.pairs[i]);
  }
  // What an update does with a disjoint pair, or one that counts as disjoint.
  void keep_or_fold(const FrontChunk& chunk, std::size_t i) { how_.prune ? fold(chunk, i) : keep(chunk, i); }

  // Keeps a disjoint pair unless its parent is disjoint too. Then all pairs below the highest disjoint
  // ancestor are, and of those the one on the path of first children (the front holds exactly one such) puts
  // that ancestor in their place.
  void fold(const FrontChunk& chunk, std::size_t i) {
    NodePair pair = chunk.pairs[i].nodes;
    if (!(parent_gap(pair) > 0)) return keep(chunk, i);
    change(chunk, i);
    ++counts_.pruned;
    float gap = 0;
    while ((gap = parent_gap(pair)) > 0) {
      if (!bvtt_.is_first_child(pair)) return;
      pair = bvtt_.parent(pair);
      folded_gap_ = gap;
    }
    push({pair, grant(pair, folded_gap_)});
  }

  // Siblings are neighbours in the front, so the last answer often serves again. What a wider question will
  // have to open again is not folded.
  float parent_gap(const NodePair& pair) {
    if (Bvtt::is_root(pair)) return -1;
    const NodePair above = bvtt_.parent(pair);
    if (bvtt_.is_self(above)) return -1;
    if (!(above == last_parent_)) {
      last_parent_ = above;
      last_gap_ = trees_.gap(above, counts_.bv_tests, fold_width_);
    }
    return last_gap_;
  }

  const TreePair<Bounds>& trees_;
  const Bvtt bvtt_;
  const PartPair& parts_;
  const bool skip_neighbours_;
  LeafPairSinks& sinks_;
  LeafPairSink& sink_;  // this thread's
  const FrontUpdate& how_;
  const Width fold_width_;
  const Answers answers_;
  FrontRoom& room_;
  ChunkScratch& scratch_;
  FrontCounts& counts_;
  PacedStop paced_{how_.stop, 512};
  std::vector<FrontPair>* pairs_ = &scratch_.pairs;               // the chunk's: there, or where they were
  NodePair last_parent_{NodeId{0xffffffff}, NodeId{0xffffffff}};  // none
  float last_gap_ = -1;
  float folded_gap_ = -1;
  std::uint64_t leaf_pairs_ = 0;  // tested
  std::uint64_t cost_ = 0;
};

}  // namespace warmfront

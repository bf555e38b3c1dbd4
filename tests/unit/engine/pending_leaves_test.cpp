// SPDX-License-Identifier: Apache-2.0
// Leaf pairs that a task of the front has found: each is tested once, by whichever tasks.
#include "engine/front/pending_leaves.h"

#include <gtest/gtest.h>
#include <tbb/enumerable_thread_specific.h>

#include <algorithm>
#include <atomic>
#include <bit>
#include <cstdint>
#include <map>
#include <mutex>
#include <span>
#include <vector>

#include "tests/support/workers.h"

namespace warmfront {
namespace {

constexpr std::uint64_t kWhole = ~std::uint64_t{0};

// All threads' sink of pairs of leaves, and of nothing else.
class OfLeafPairs : public LeafPairSinks, public LeafPairSink {
 public:
  LeafPairSink& local() override { return *this; }
  StageClock& clock() override { return clocks_.local(); }
  LeafGap leaf_pair_at_rest(const PartPair&, const NodePair&, const LeafBlocks&, RestAnswer&) override {
    ADD_FAILURE() << "not asked for";
    return {};
  }
  void neighbours(PartId, NeighbourChunk&) override {}
  void neighbours_at_rest(PartId, NeighbourChunk&) override {}
  void keep(std::uint64_t, const ContactTally&, std::span<const Contact>) override {}
  std::uint64_t triangle_pairs() const override { return done_; }

 protected:
  std::atomic<std::uint64_t> done_{0};
  std::mutex mutex_;

 private:
  tbb::enumerable_thread_specific<StageClock> clocks_;
};

// Notes what it is asked for, each of which is so much work.
class Asked final : public OfLeafPairs {
 public:
  explicit Asked(std::uint64_t work) : work_(work) {}

  // Each part of a pair of leaves tells another thing, of which the whole pair's answer is made.
  LeafGap leaf_pair(const PartPair&, const NodePair& leaves, const LeafBlocks& which) override {
    const std::lock_guard lock(mutex_);
    of[number_of(leaves.a)].push_back(which);
    done_ += work_;
    return {static_cast<float>(std::countr_zero(which.among)), which.among >> 63 != 0, which.among & 0x80008};
  }

  std::map<std::uint32_t, std::vector<LeafBlocks>> of;

 private:
  const std::uint64_t work_;
};

// Adds pairs until there is no room, tests them, and looks at what was asked for and learnt.
void test_full(Asked& asked, bool wide) {
  PendingLeaves pending;
  std::vector<LeafGap> learnt;
  std::uint32_t count = 0;
  testing::workers()->run([&] {
    pending.begin(asked);
    for (; !pending.full(); ++count) pending.add({{NodeId{count}, NodeId{count + 1}}, count, count * 7});
    pending.test({}, true, wide, asked, asked, [&](const PendingLeaves::Pair& pair, const LeafGap& gap) {
      EXPECT_EQ(pair.place, learnt.size()) << "in order";
      EXPECT_EQ(pair.leaves, (NodePair{NodeId{pair.place}, NodeId{pair.place + 1}}));
      learnt.push_back(gap);
    });
    EXPECT_FALSE(pending.full());
    pending.test({}, true, wide, asked, asked, [&](const auto&, const auto&) { ADD_FAILURE(); });
  });
  EXPECT_EQ(learnt.size(), count);
  EXPECT_EQ(asked.of.size(), learnt.size());
  for (const auto& [leaf, all] : asked.of) {
    std::uint64_t among = 0;
    for (const LeafBlocks& which : all) {
      EXPECT_TRUE(which.skip_neighbours);
      EXPECT_EQ(which.neighbours, leaf * 7);
      EXPECT_EQ(among & which.among, 0U) << "twice";
      among |= which.among;
    }
    EXPECT_EQ(among, kWhole) << "of leaf pair " << leaf;
  }
  for (const LeafGap& gap : learnt) {
    EXPECT_EQ(gap.gap, 0);
    EXPECT_TRUE(gap.adjacent);
    EXPECT_EQ(gap.neighbours, 0x80008U);
  }
}

TEST(PendingLeaves, LightOnesAreTestedOneByOne) {
  Asked asked(1);
  test_full(asked, true);
  for (const auto& [leaf, all] : asked.of) EXPECT_EQ(all.size(), 1U) << leaf;
}

TEST(PendingLeaves, OfHeavyOnesAllButTheFirstAreDivided) {
  Asked asked(1000);
  test_full(asked, true);
  for (const auto& [leaf, all] : asked.of) EXPECT_EQ(all.size(), leaf == 0 ? 1U : 8U) << leaf;
}

TEST(PendingLeaves, LeavesOfOneBlockAreNot) {
  Asked asked(1000);
  test_full(asked, false);
  for (const auto& [leaf, all] : asked.of) EXPECT_EQ(all.size(), 1U) << leaf;
}

// As the real one does: a row of blocks after another, each so many triangle pairs, as far as it may at once.
class RowByRow final : public OfLeafPairs {
 public:
  LeafGap leaf_pair(const PartPair&, const NodePair& leaves, const LeafBlocks& which) override {
    const std::lock_guard lock(mutex_);
    ++calls;
    LeafGap learnt = LeafGap::of_nothing();
    learnt.left = 0;
    std::uint64_t done = 0;
    for (int row = 0; row < 8; ++row) {
      const std::uint64_t of_row = std::uint64_t{0xff} << 8 * row;
      if ((which.among & of_row) == 0) continue;
      if (done >= which.at_once) {
        learnt.left |= which.among & of_row;
        continue;
      }
      EXPECT_EQ(tested[number_of(leaves.a)] & of_row, 0U) << "twice";
      tested[number_of(leaves.a)] |= which.among & of_row;
      learnt.gap = std::min(learnt.gap, static_cast<float>(10 - row));
      learnt.adjacent |= row == 0;
      learnt.neighbours |= std::uint64_t{1} << 8 * row;
      done += kOfRow;
    }
    done_ += done;
    return learnt;
  }

  static constexpr std::uint64_t kOfRow = 100;
  std::map<std::uint32_t, std::uint64_t> tested;
  int calls = 0;
};

// A pair that is much by itself is shared out from the middle on, and what is learnt of it is of all of it.
TEST(PendingLeaves, AHeavyPairIsDividedInTheMiddle) {
  for (const std::uint32_t pairs : {1U, 2U, 5U}) {
    RowByRow sink;
    PendingLeaves pending;
    std::uint32_t taken = 0;
    testing::workers()->run([&] {
      pending.begin(sink);
      for (std::uint32_t n = 0; n < pairs; ++n) pending.add({{NodeId{n}, NodeId{9}}, n, 0});
      pending.test({}, true, true, sink, sink, [&](const PendingLeaves::Pair& pair, const LeafGap& gap) {
        EXPECT_EQ(pair.place, taken++);
        EXPECT_EQ(gap.gap, 3);
        EXPECT_TRUE(gap.adjacent);
        EXPECT_EQ(gap.neighbours, 0x0101010101010101U);
        EXPECT_EQ(gap.left, 0U);
      });
    });
    EXPECT_EQ(taken, pairs);
    for (std::uint32_t n = 0; n < pairs; ++n) EXPECT_EQ(sink.tested[n], kWhole) << n;
    // Of the first, six rows at once and the last two as two tasks; of the others all tasks each.
    EXPECT_EQ(sink.calls, 3 + 8 * static_cast<int>(pairs - 1));
  }
}

// What a chunk has taken before counts.
TEST(PendingLeaves, AChunkThatWasMuchIsDividedFromThenOn) {
  Asked asked(1000);
  PendingLeaves pending;
  testing::workers()->run([&] {
    pending.begin(asked);
    for (const std::uint32_t n : {0U, 1U, 2U}) {
      pending.add({{NodeId{n}, NodeId{9}}, n, 0});
      pending.test({}, false, true, asked, asked, [](const auto&, const auto&) {});
    }
    pending.begin(asked);
    pending.add({{NodeId{3}, NodeId{9}}, 0, 0});
    pending.test({}, false, true, asked, asked, [](const auto&, const auto&) {});
  });
  EXPECT_EQ(asked.of[0].size(), 1U);
  EXPECT_EQ(asked.of[1].size(), 8U);
  EXPECT_EQ(asked.of[2].size(), 8U);
  EXPECT_EQ(asked.of[3].size(), 1U) << "another chunk";
}

}  // namespace
}  // namespace warmfront

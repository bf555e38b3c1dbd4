// SPDX-License-Identifier: Apache-2.0
// Eight bounds against eight up to a time within the step, and the same in double, one pair at a time.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <limits>
#include <random>

#include "engine/bvh/eight_bounds.h"
#include "engine/bvh/shared_vertices.h"
#include "tests/unit/engine/random_leaf.h"

namespace warmfront {
namespace {

using testing::all_near;
using testing::Leaf;
using testing::make_endless;
using testing::random_leaf;
using testing::random_width;

// Gaps are linear in time: beyond the width at both ends of a span, beyond it throughout.
template <class Bounds>
bool apart_until(const Bounds& a, const Bounds& b, double until, const Width& width) {
  for (int k = 0; k < Bounds::kAxes; ++k) {
    const auto open = [&](int lower, int upper) {
      const auto gap = [&](int end) { return double{a.lane[end + lower]} + double{b.lane[end + upper]}; };
      const double at0 = gap(0);
      const double at_until = (1 - until) * at0 + until * gap(Bounds::kEnd);
      return std::min(at0, at_until) > double{width.along(k)};
    };
    if (open(k, k + Bounds::kAxes) || open(k + Bounds::kAxes, k)) return true;
  }
  return false;
}

// Everything moves so many times as far as it is away: the units of both ends differ.
template <class Bounds>
void move_on(Leaf<Bounds>& leaf, float times) {
  leaf.node = Bounds::empty();
  for (Bounds& bounds : leaf.bounds) {
    for (int k = Bounds::kEnd; k < 2 * Bounds::kEnd; ++k) bounds.lane[k] *= times;
    leaf.node.merge(bounds);
  }
  number(leaf);
}

// At the end of the step it is beside where it was, by up to so many times what leaves measure, along each
// axis.
template <class Bounds>
void fly_past(std::mt19937& random, Leaf<Bounds>& leaf) {
  leaf.node = Bounds::empty();
  std::array<float, Bounds::kAxes> way;
  for (float& w : way) w = std::ldexp(static_cast<float>(random() % 41) - 20, static_cast<int>(random() % 8));
  for (Bounds& bounds : leaf.bounds) {
    for (int k = 0; k < Bounds::kAxes; ++k) {
      bounds.lane[Bounds::kEnd + k] += way[k];
      bounds.lane[Bounds::kEnd + Bounds::kAxes + k] -= way[k];
    }
    leaf.node.merge(bounds);
  }
  number(leaf);
}

// Mostly with all that can be known.
template <class Bounds>
GridPair<Bounds> related(std::mt19937& random, const Leaf<Bounds>& a, const Leaf<Bounds>& b,
                         const Width& width) {
  GridPair<Bounds> between = grid_pair(a.grid, b.grid, width);
  if (random() % 8 != 0) between.learn_end(a.grid, b.grid, width);
  return between;
}

float random_time(std::mt19937& random) {
  constexpr float kTimes[] = {0,        0x1p-100F, 0x1p-24F, 0x1p-20F, 7.5e-6F, 0x1p-14F,
                              0x1p-10F, 0x1p-7F,   0.1F,     0.5F,     0.999F};
  return kTimes[random() % std::size(kTimes)];
}

template <class Bounds>
class EightBoundsUntilTest : public ::testing::Test {};
using Kinds = ::testing::Types<Aabb, KDop18>;
TYPED_TEST_SUITE(EightBoundsUntilTest, Kinds);

TYPED_TEST(EightBoundsUntilTest, WhatMeetsByThenIsFound) {
  std::mt19937 random(21);
  int met = 0;
  int apart = 0;  // by then, not at the end
  int beside = 0;
  for (int trial = 0; trial < 8000; ++trial) {
    auto a = random_leaf<TypeParam>(random);
    auto b = random_leaf<TypeParam>(random);
    if (trial % 2 == 0) {
      const float times = std::ldexp(1.0F, static_cast<int>(random() % 24) - 12);
      move_on(a, times);
      move_on(b, times);
    } else {
      fly_past(random, b);
    }
    const Width width = random_width(random);
    const float until = random_time(random);
    const GridPair<TypeParam> between = related(random, a, b, width);
    const OneOfLeaf whole_b = OneOfLeaf::of(b.grid);
    Rebased<TypeParam> over;
    rebase(a.block, between, over);
    const std::uint64_t none = no_pairs(a.count(), b.count(), false);
    const EightOverlaps overlaps = primitive_overlaps(over, b.block, between, &whole_b, none, until);
    const EightOverlaps blocks =
        block_overlaps(a.block, b.block, {a.count(), b.count(), false}, between, whole_b, until);
    ASSERT_EQ(overlaps.unsure & ~overlaps.to_test, 0U);
    for (std::uint32_t i = 0; i < a.count(); ++i) {
      for (std::uint32_t j = 0; j < b.count(); ++j) {
        const bool found = ((overlaps.to_test >> (8 * j + i)) & 1U) != 0;
        const bool of_blocks = ((blocks.to_test >> (8 * j + i)) & 1U) != 0;
        const bool meet = !apart_until(a.bounds[i], b.bounds[j], until, width);
        ASSERT_TRUE(found || !meet) << trial << ": " << i << ", " << j << " until " << until;
        ASSERT_TRUE(of_blocks || !meet) << trial << ": " << i << ", " << j << " until " << until;
        met += meet;
        beside += found && !meet;
        apart += !found && !apart_until(a.bounds[i], b.bounds[j], 1, width);
      }
    }
  }
  EXPECT_GT(met, 1000);
  EXPECT_GT(apart, 1000);
  EXPECT_LT(beside, met / 4);
}

TYPED_TEST(EightBoundsUntilTest, NothingIsApartFromWhatIsInfinite) {
  std::mt19937 random(22);
  for (int trial = 0; trial < 400; ++trial) {
    auto a = random_leaf<TypeParam>(random);
    auto b = random_leaf<TypeParam>(random);
    make_endless(trial % 2 == 0 ? a : b, trial % 4 < 2 ? 0 : 1);
    const float until = random_time(random);
    const EightOverlaps overlaps =
        block_overlaps(a.block, b.block, {a.count(), b.count(), false},
                       related(random, a, b, random_width(random)), OneOfLeaf::of(b.grid), until);
    ASSERT_TRUE(all_near(overlaps, a, b)) << trial;
  }
}

}  // namespace
}  // namespace warmfront

// SPDX-License-Identifier: Apache-2.0
// A budget must be spent before the boxes that it was granted for can meet.
#include "engine/bvh/travel.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include "engine/bounds/overlap.h"
#include "engine/bvh/tree_travel.h"
#include "engine/workers.h"
#include "tests/support/hierarchy.h"
#include "tests/support/scenes.h"

namespace warmfront {
namespace {

TEST(TravelBudget, EndsWithTheGapAndCountsOnlyRelativeMotion) {
  NodeTravel a;
  NodeTravel b{{1, 0, 0}, 0};
  const TravelBudget budget = TravelBudget::grant(a, b, 0.25F);
  EXPECT_FALSE(budget.exhausted(a, b, 10));
  a.centre = {7, 3, -2};
  b.centre = {8, 3, -2};
  EXPECT_FALSE(budget.exhausted(a, b, 10)) << "both moved alike";
  b.centre[0] -= 0.2F;
  EXPECT_FALSE(budget.exhausted(a, b, 10));
  a.wandered += travel::units(0.1F);
  EXPECT_TRUE(budget.exhausted(a, b, 10));
}

TEST(TravelBudget, NothingIsPromisedWithoutAGapOrBeyondTheLimits) {
  const NodeTravel a;
  const NodeTravel b{{1, 0, 0}, 0};
  for (const float gap : {0.0F, -1.0F, std::numeric_limits<float>::quiet_NaN()})
    EXPECT_TRUE(TravelBudget::grant(a, b, gap).exhausted(a, b, 0)) << gap;
  const TravelBudget large = TravelBudget::grant(a, b, std::numeric_limits<float>::infinity());
  EXPECT_FALSE(large.exhausted(a, b, travel::slack(1)));
  EXPECT_TRUE(large.exhausted(a, b, travel::slack(1e30)));
  NodeTravel lost = b;
  lost.centre[1] = std::numeric_limits<float>::quiet_NaN();
  EXPECT_TRUE(large.exhausted(a, lost, 0));
  NodeTravel far = b;
  far.wandered += travel::units(std::numeric_limits<float>::infinity());
  EXPECT_TRUE(large.exhausted(a, far, 0));
}

/// Two nodes of a few points each, whose travel is known.
struct TwoNodes {
  static constexpr std::size_t kPoints = 3;
  struct Place {
    std::array<std::array<std::array<float, 3>, kPoints>, 2> at{};
    std::array<NodeTravel, 2> travel{};
  };

  // Where each node goes by some displacement, and its points by a little of their own.
  Place moved(const Place& from, float far, float little) {
    Place to = from;
    for (int node = 0; node < 2; ++node) {
      float width = 0;
      for (int axis = 0; axis < 3; ++axis) {
        const float common = far * uniform(random);
        float least = 1;
        float most = -1;
        for (auto& point : to.at[node]) {
          const float step = common + little * uniform(random);
          point[axis] += step;
          least = std::min(least, step);
          most = std::max(most, step);
        }
        to.travel[node].centre[axis] += 0.5F * least + 0.5F * most;
        width = std::max(width, most - least);
      }
      to.travel[node].wandered += travel::units(0.5F * width) + travel::slack(1);
    }
    return to;
  }
  // A part of the way, as a commit takes it.
  static Place part(const Place& from, const Place& to, float f) {
    Place at = from;
    for (int node = 0; node < 2; ++node) {
      for (std::size_t i = 0; i < kPoints; ++i) {
        for (int axis = 0; axis < 3; ++axis)
          at.at[node][i][axis] += f * (to.at[node][i][axis] - from.at[node][i][axis]);
      }
      NodeTravel& travel = at.travel[node];
      for (int axis = 0; axis < 3; ++axis)
        travel.centre[axis] += f * (to.travel[node].centre[axis] - from.travel[node].centre[axis]);
      travel.wandered = to.travel[node].wandered + travel::slack(1);
    }
    return at;
  }
  static float gap(const Place& place) {
    float gap = -1;
    for (int axis = 0; axis < 3; ++axis) {
      std::array<float, 2> low{9, 9};
      std::array<float, 2> high{-9, -9};
      for (int node = 0; node < 2; ++node) {
        for (const auto& point : place.at[node]) {
          low[node] = std::min(low[node], point[axis]);
          high[node] = std::max(high[node], point[axis]);
        }
      }
      gap = std::max({gap, low[0] - high[1], low[1] - high[0]});
    }
    return gap;
  }
  static bool lasts(const TravelBudget& budget, const Place& at) {
    return !budget.exhausted(at.travel[0], at.travel[1], 2 * travel::slack(1));
  }
  static bool leave(TravelBudget& budget, const Place& base, const Place& end, TrialLeft left) {
    return leave_trial(budget, {end.travel, base.travel}, 0, {end.travel, base.travel}, 1, left,
                       2 * travel::slack(1));
  }

  std::mt19937 random{3};
  std::uniform_real_distribution<float> uniform{-1, 1};
};

TEST(TravelBudget, OfATrialsEndHoldsForWhatBeginsElsewhere) {
  TwoNodes nodes;
  int lasted = 0;
  int spent = 0;
  int nearer = 0;
  for (int run = 0; run < 20'000; ++run) {
    const TwoNodes::Place base = nodes.moved({}, 0.5F, 0.1F);
    const TwoNodes::Place end = nodes.moved(base, 0.2F, 0.1F);
    const float gap = TwoNodes::gap(end);
    if (!(gap > 0)) continue;
    const TravelBudget granted = TravelBudget::grant(end.travel[0], end.travel[1], gap);
    TravelBudget at_base = granted;
    const bool holds = TwoNodes::leave(at_base, base, end, TrialLeft::kForBase);
    EXPECT_EQ(holds, TwoNodes::lasts(at_base, base));
    if (holds) {
      ASSERT_GT(TwoNodes::gap(base), 0);
    }
    spent += holds ? 0 : 1;
    const TwoNodes::Place other = nodes.moved(base, 0.2F, 0.1F);
    if (TwoNodes::lasts(at_base, other)) {
      ASSERT_GT(TwoNodes::gap(other), 0);
      ++lasted;
      nearer += TwoNodes::gap(other) < gap ? 1 : 0;
    }
    TravelBudget on_way = granted;
    TwoNodes::leave(on_way, base, end, TrialLeft::kForPartWay);
    const TwoNodes::Place half = TwoNodes::part(base, end, 0.5F);
    if (!TwoNodes::lasts(on_way, half)) continue;
    ASSERT_GT(TwoNodes::gap(half), 0);
    const TwoNodes::Place on = nodes.moved(half, 0.2F, 0.1F);
    if (TwoNodes::lasts(on_way, on)) {
      ASSERT_GT(TwoNodes::gap(on), 0);
      ++lasted;
    }
  }
  EXPECT_GT(lasted, 1000);
  EXPECT_GT(nearer, 100);
  EXPECT_GT(spent, 1000);
}

TEST(TravelBudget, OfAnotherPlaceThanATrialsEndStays) {
  const std::array<NodeTravel, 2> base{};
  std::array<NodeTravel, 2> end{};
  end[0] = {{0.25F, 0, 0}, 5000};
  const TravelBudget before = TravelBudget::grant(base[0], base[1], 1);
  TravelBudget budget = before;
  EXPECT_TRUE(leave_trial(budget, {end, base}, 0, {end, base}, 1, TrialLeft::kForBase, 0));
  EXPECT_EQ(budget.expiry, before.expiry);
  // One that wandered so far that nothing lasts.
  end[0].wandered = travel::kMost;
  budget = TravelBudget::grant(end[0], end[1], 1);
  EXPECT_FALSE(leave_trial(budget, {end, base}, 0, {end, base}, 1, TrialLeft::kForBase, 0));
  EXPECT_TRUE(budget.exhausted(base[0], base[1], 0));
}

// While a budget lasts, the nodes are apart in every single step.
template <class Bounds>
void expect_apart_while_it_lasts() {
  std::mt19937_64 random(11);
  std::uint64_t lasted = 0;
  for (int trial = 0; trial < 30; ++trial) {
    auto [scene, positions] = testing::random_scene(random);
    testing::Hierarchy<Bounds> hierarchy(scene, positions, 2);
    const Bvh<Bounds>& bvh = hierarchy.bvh;
    const auto nodes = static_cast<std::uint32_t>(bvh.nodes.size());
    hierarchy.step(positions);
    struct Promise {
      std::uint32_t a;  // nodes
      std::uint32_t b;
      TravelBudget budget;
    };
    std::vector<Promise> promises;
    for (int i = 0; i < 300 && nodes > 1; ++i) {
      const auto a = static_cast<std::uint32_t>(random() % nodes);
      const auto b = static_cast<std::uint32_t>(random() % nodes);
      const float gap = separation(bvh.nodes[a], bvh.nodes[b]);
      if (gap > 0)
        promises.push_back({a, b, TravelBudget::grant(bvh.travel.nodes[a], bvh.travel.nodes[b], gap)});
    }
    for (int step = 0; step < 12; ++step) {
      // Slow, with a common drift that is fast.
      std::vector<double> next = testing::random_motion(random, *scene, positions);
      for (std::size_t k = 0; k < next.size(); ++k)
        next[k] = positions[k] + 0.02 * (next[k] - positions[k]) + 0.3;
      hierarchy.step(next);
      positions = next;
      std::erase_if(promises, [&](const Promise& p) {
        return p.budget.exhausted(bvh.travel.nodes[p.a], bvh.travel.nodes[p.b], bvh.travel.slack);
      });
      for (const Promise& p : promises) ASSERT_FALSE(overlap(bvh.nodes[p.a], bvh.nodes[p.b])) << trial;
      lasted += promises.size();
    }
  }
  EXPECT_GT(lasted, 1000U);
}

// Of a block, each once.
template <class Bounds>
std::vector<std::size_t> vertices_of(const Bvh<Bounds>& bvh, std::size_t block) {
  std::vector<std::size_t> vertices;
  for (std::uint32_t left = bvh.travel.first_corners[block]; left != 0; left &= left - 1) {
    const int first = std::countr_zero(left);
    vertices.push_back(bvh.leaves.corners[block].vertex[first / 8][first % 8]);
  }
  return vertices;
}

// Two thirds move away, then return one after the other: the middle of the displacements has not. A leaf's
// sum of them must still keep the precision of budgets.
template <class Bounds>
void expect_sums_within_reach() {
  const std::vector<double> positions{1, 0, 0, -1, 0, 0, 0, 1, 0, 0, -1, 0, 0, 0, 1, 0, 0, -1};
  testing::Hierarchy<Bounds> hierarchy(testing::make_scene(6, testing::octahedron()), positions, 8);
  const Bvh<Bounds>& bvh = hierarchy.bvh;
  const NodeTravel& travel = bvh.travel.nodes[number_of(bvh.shape.first_leaf())];
  const auto third = [&](std::size_t coordinate) {
    const auto vertices = vertices_of(bvh, 0);
    return (std::ranges::find(vertices, coordinate / 3) - vertices.begin()) % 3;
  };
  constexpr double kWay = 0.2;
  int began_anew = 0;
  const auto step = [&](const std::vector<double>& to) {
    const NodeTravel before = travel;
    const TravelBudget budget = TravelBudget::grant(before, {}, std::numeric_limits<float>::infinity());
    hierarchy.step(to);
    for (int k = 0; k < 3; ++k) {
      ASSERT_LE(std::fabs(travel.centre[k]), 2 * hierarchy.motion().magnitude());
      if (std::fabs(travel.centre[k] - before.centre[k]) < 2 * kWay) continue;
      ++began_anew;
      ASSERT_TRUE(budget.exhausted(travel, {}, bvh.travel.slack));
    }
  };
  for (int cycle = 0; cycle < 200; ++cycle) {
    std::vector<double> moved = positions;
    for (std::size_t k = 0; k < moved.size(); ++k) moved[k] += third(k) < 2 ? kWay : 0;
    step(moved);
    for (std::size_t k = 0; k < moved.size(); ++k) moved[k] = third(k) == 1 ? moved[k] : positions[k];
    step(moved);
    step(positions);
  }
  EXPECT_GT(began_anew, 10);
}

TEST(TravelBudget, SumsOfMotionDoNotGrowForEver) {
  Workers(1).run([] {
    expect_sums_within_reach<Aabb>();
    expect_sums_within_reach<KDop18>();
  });
}

TEST(TravelBudget, LastsOnlyWhileApart) {
  Workers(1).run([] {
    expect_apart_while_it_lasts<Aabb>();
    expect_apart_while_it_lasts<KDop18>();
  });
}

}  // namespace
}  // namespace warmfront

// SPDX-License-Identifier: Apache-2.0
#include "engine/front/build_tasks.h"

#include <algorithm>
#include <bit>

#include "engine/front/descend.h"

namespace warmfront {
namespace {

int level_of(NodeId node) {
  return std::bit_width(node + 1) - 1;
}

// The share of `a`'s box that lies in the box of `b`.
template <class Bounds>
double overlap_share(const Bounds& a, const Bounds& b) {
  double share = 1;
  for (int axis = 0; axis < 3; ++axis) {
    const double extent = double{a.upper(axis)} - double{a.lower(axis)};
    const double common =
        double{std::min(a.upper(axis), b.upper(axis))} - double{std::max(a.lower(axis), b.lower(axis))};
    if (extent > 0) share *= std::clamp(common / extent, 0.0, 1.0);
  }
  return share;
}

template <class Bounds>
double cost(const Bvh<Bounds>& bvh, const NodePair& pair) {
  const int depth = bvh.shape.levels() - 1;
  const int below_a = depth - level_of(pair.a);
  const int below_b = depth - level_of(pair.b);
  if (pair.a == pair.b) return static_cast<double>(1U << below_a) * (below_a + 1);
  const Bounds& a = bvh.nodes[pair.a];
  const Bounds& b = bvh.nodes[pair.b];
  return (static_cast<double>(1U << below_a) * overlap_share(a, b) +
          static_cast<double>(1U << below_b) * overlap_share(b, a)) *
             2 +
         below_a + below_b;
}

}  // namespace

template <class Bounds>
BuildTasks decompose(const Bvh<Bounds>& bvh) {
  constexpr double kShare = 1.0 / 256;
  constexpr std::size_t kMostTasks = 8192;
  BuildTasks result;
  result.tasks = {{{0, 0}, -1}};
  const double most = cost(bvh, {0, 0}) * kShare;
  const auto is_leaf_pair = [&](const NodePair& pair) { return bvh.shape.is_leaf(pair.a); };
  for (bool opened = true; opened && result.tasks.size() < kMostTasks;) {
    opened = false;
    std::vector<BuildTask> next;
    for (const BuildTask& task : result.tasks) {
      if (task.gap > 0 || is_leaf_pair(task.pair) || cost(bvh, task.pair) <= most) {
        next.push_back(task);
        continue;
      }
      opened = true;
      for_children(task.pair, [&](const NodePair& child) {
        const bool self = child.a == child.b;
        if (!self) ++result.bv_tests;
        next.push_back({child, self ? -1 : separation(bvh.nodes[child.a], bvh.nodes[child.b])});
      });
    }
    result.tasks = std::move(next);
  }
  return result;
}

template BuildTasks decompose(const Bvh<Aabb>&);
template BuildTasks decompose(const Bvh<KDop18>&);

}  // namespace warmfront

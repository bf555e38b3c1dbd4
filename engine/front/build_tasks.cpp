// SPDX-License-Identifier: Apache-2.0
#include "engine/front/build_tasks.h"

#include <algorithm>
#include <cstddef>
#include <span>

#include "engine/parallel/fork_join.h"

namespace warmfront {
namespace {

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

}  // namespace

template <class Bounds>
double build_cost(const TreePair<Bounds>& trees, const NodePair& pair) {
  const int below_a = trees.a.shape.levels() - 1 - TreeShape::level_of(pair.a);
  const int below_b = trees.b.shape.levels() - 1 - TreeShape::level_of(pair.b);
  if (trees.bvtt().is_self(pair)) return static_cast<double>(1U << below_a) * (below_a + 1);
  const Bounds& a = trees.a.nodes[number_of(pair.a)];
  const Bounds& b = trees.b.nodes[number_of(pair.b)];
  return (static_cast<double>(1U << below_a) * overlap_share(a, b) +
          static_cast<double>(1U << below_b) * overlap_share(b, a)) *
             2 +
         below_a + below_b;
}

template <class Bounds>
std::vector<BuildTask> decompose(const TreePair<Bounds>& trees, double most, std::uint64_t& bv_tests) {
  constexpr std::size_t kMostTasks = 8192;
  constexpr std::size_t kPiece = 64;
  const Bvtt bvtt = trees.bvtt();
  std::vector<BuildTask> tasks{{Bvtt::root(), trees.gap(Bvtt::root(), bv_tests)}};
  struct Opened {
    std::vector<BuildTask> tasks;
    std::uint64_t bv_tests = 0;
  };
  std::vector<Opened> opened;  // by piece of the tasks
  for (std::size_t before = 0; tasks.size() != before && tasks.size() < kMostTasks;) {
    before = tasks.size();
    opened.assign((before + kPiece - 1) / kPiece, {});
    const auto open_piece = [&](std::size_t piece) {
      Opened& to = opened[piece];
      const std::size_t first = piece * kPiece;
      for (const BuildTask& task : std::span(tasks).subspan(first, std::min(kPiece, before - first))) {
        if (task.gap > 0 || bvtt.is_leaf(task.pair) || build_cost(trees, task.pair) <= most)
          to.tasks.push_back(task);
        else
          bvtt.for_children(task.pair, [&](const NodePair& child) {
            to.tasks.push_back({child, trees.gap(child, to.bv_tests)});
          });
      }
    };
    if (opened.size() == 1)
      open_piece(0);
    else
      fork_each(std::size_t{0}, opened.size(), open_piece);
    tasks.clear();
    for (const Opened& piece : opened) {
      tasks.insert(tasks.end(), piece.tasks.begin(), piece.tasks.end());
      bv_tests += piece.bv_tests;
    }
  }
  return tasks;
}

template double build_cost(const TreePair<Aabb>&, const NodePair&);
template double build_cost(const TreePair<KDop18>&, const NodePair&);
template std::vector<BuildTask> decompose(const TreePair<Aabb>&, double, std::uint64_t&);
template std::vector<BuildTask> decompose(const TreePair<KDop18>&, double, std::uint64_t&);

}  // namespace warmfront

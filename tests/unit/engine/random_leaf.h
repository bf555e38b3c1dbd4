// SPDX-License-Identifier: Apache-2.0
// Leaves of a hierarchy with eight bounds or fewer, drawn for the tests of their numbers.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <limits>
#include <random>
#include <vector>

#include "engine/bounds/width.h"
#include "engine/bvh/eight_bounds.h"
#include "engine/bvh/shared_vertices.h"

namespace warmfront::testing {

template <class Bounds>
struct Leaf {
  std::vector<Bounds> bounds;
  Bounds node = Bounds::empty();
  LeafGrid<Bounds> grid{};
  EightBounds<Bounds> block{};
  EightCorners corners{};

  std::uint32_t count() const { return static_cast<std::uint32_t>(bounds.size()); }
};

// The quantised bounds in their leaf: the largest numbers that are not above. Empty slots repeat the first.
template <class Bounds>
void put_numbers(Leaf<Bounds>& leaf, std::uint32_t slot) {
  constexpr std::size_t kAxes = Bounds::kAxes;
  for (std::size_t t = 0; t < 2; ++t) {
    const auto& end = leaf.grid.end[t];
    const double unit = std::ldexp(1.0, end.exponent);
    for (std::size_t k = 0; k < kAxes; ++k) {
      auto* to = const_cast<std::int16_t*>(OneOfLeaf::of(leaf.block, leaf.grid.begin_at_1, slot)(t, k));
      const float* lane = &leaf.bounds[slot < leaf.count() ? slot : 0].lane[t * Bounds::kEnd + k];
      const auto number = [&](double length) {
        return end.none() ? leaf.grid.kNever : static_cast<std::int16_t>(std::floor(length / unit));
      };
      to[0] = number(lane[0] - double{end.origin[k]});
      to[1] = number(lane[kAxes] + double{end.origin[k]});
    }
  }
}

template <class Bounds>
void number(Leaf<Bounds>& leaf) {
  for (const std::size_t t : {0, 1}) leaf.grid.set(leaf.node, t);
  for (std::uint32_t i = 0; i < 8; ++i) put_numbers(leaf, i);
}

// Small boxes on a small grid, so that many touch, of one of two sizes, so that leaves have different units;
// few vertices, so that many are shared.
template <class Bounds>
Leaf<Bounds> random_leaf(std::mt19937& random) {
  Leaf<Bounds> leaf;
  const std::uint32_t count = 1 + random() % 8;
  leaf.grid.begin_at_1 = random() % 2 == 0 ? 0 : Bounds::kAxes;
  const float size = random() % 3 == 0 ? 0.03F : 1;
  const float from = size < 1 ? static_cast<float>(random() % 12) : 0;
  for (std::uint32_t i = 0; i < count; ++i) {
    Bounds bounds;
    for (const int end : {0, Bounds::kEnd}) {
      for (int axis = end; axis < end + Bounds::kAxes; ++axis) {
        const float lower = from + size * static_cast<float>(random() % 12);
        bounds.lane[axis] = lower;
        bounds.lane[axis + Bounds::kAxes] = -(lower + size * static_cast<float>(random() % 8));
      }
    }
    leaf.bounds.push_back(bounds);
    leaf.node.merge(bounds);
    for (auto& corner : leaf.corners.vertex) corner[i] = random() % 24;
  }
  for (auto& corner : leaf.corners.vertex) std::fill(corner.begin() + count, corner.end(), corner[0]);
  number(leaf);
  return leaf;
}

// None, less than a unit of a leaf, about a leaf, and many leaves.
inline Width random_width(std::mt19937& random) {
  constexpr double kLengths[] = {0, 1e-6, 0.02, 0.7, 5, 300, 1e9};
  return Width::of(kLengths[random() % std::size(kLengths)]);
}

// One of its bounds is infinite at an end of the step (0 or 1): the other end alone keeps nothing apart then.
template <class Bounds>
void make_endless(Leaf<Bounds>& leaf, std::size_t t) {
  for (std::size_t k = 0; k < Bounds::kEnd; ++k)
    leaf.bounds[0].lane[k + t * Bounds::kEnd] = -std::numeric_limits<float>::infinity();
  leaf.node.merge(leaf.bounds[0]);
  number(leaf);
}

// Does `overlaps` have every pair of a primitive of either?
template <class Bounds>
bool all_near(const EightOverlaps& overlaps, const Leaf<Bounds>& a, const Leaf<Bounds>& b) {
  const std::uint64_t pairs = ~no_pairs(b.count(), a.count(), false);
  return (overlaps.to_test & pairs) == pairs;
}

}  // namespace warmfront::testing

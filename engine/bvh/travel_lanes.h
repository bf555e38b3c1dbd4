// SPDX-License-Identifier: Apache-2.0
// A node's travel within a step: the inlined core of refit's last touch on each node. Only for sources that
// dispatch by instruction set.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <span>

#include "engine/bounds/bounds_lanes.h"
#include "engine/bvh/bvh.h"

namespace warmfront {

// Where the bounds' centre is at t = 1.
template <class Bounds>
WARMFRONT_INLINE std::array<float, 3> centre_of(const Bounds& bounds) {
  std::array<float, 3> centre;
  for (int k = 0; k < 3; ++k)
    centre[k] = 0.5F * (bounds.lane[Bounds::kEnd + k] - bounds.lane[Bounds::kEnd + Bounds::kAxes + k]);
  return centre;
}

// How far any slab moved within the step otherwise than by (x, y, z).
WARMFRONT_INLINE float wandered(const KDop18& bounds, float x, float y, float z) {
  const Float8 common{x, y, z, x + y, x - y, y + z, y - z, z + x};
  constexpr Float8 kWeight{1, 1, 1, 0.5F, 0.5F, 0.5F, 0.5F, 0.5F};
  const EightAxes at0 = eight_axes(bounds, 0);
  const EightAxes at1 = eight_axes(bounds, KDop18::kEnd);
  const Float8 eight =
      kWeight * greater(magnitude(at1.lower - at0.lower - common), magnitude(at1.upper - at0.upper + common));
  const auto ninth = [&](int lane, float by) {
    return 0.5F * (bounds.lane[KDop18::kEnd + lane] - bounds.lane[lane] + by);
  };
  const float low = ninth(8, x - z);
  const float high = ninth(17, z - x);
  return largest(greater(eight, magnitude(Float8{low, high})));
}

WARMFRONT_INLINE float wandered(const Aabb& bounds, float x, float y, float z) {
  const Float8 change{bounds.lane[6] - bounds.lane[0] - x,  bounds.lane[7] - bounds.lane[1] - y,
                      bounds.lane[8] - bounds.lane[2] - z,  bounds.lane[9] - bounds.lane[3] + x,
                      bounds.lane[10] - bounds.lane[4] + y, bounds.lane[11] - bounds.lane[5] + z};
  return largest(magnitude(change));
}

// Between what displacements vertices' lie, along each axis.
struct Displacements {
  Float4 least = Float4{} + std::numeric_limits<float>::infinity();
  Float4 most = Float4{} - std::numeric_limits<float>::infinity();

  WARMFRONT_INLINE void see(const PointBounds& vertex) {
    const Float4 change = load<Float4>(vertex.at[1].data()) - load<Float4>(vertex.at[0].data());
    least = lesser(change, least);
    most = greater(change, most);
  }
  WARMFRONT_INLINE void see(const Displacements& others) {
    least = lesser(others.least, least);
    most = greater(others.most, most);
  }
};

// The travel of a leaf or a block, of coordinates up to `magnitude`. No bounds of what is made of its
// vertices moved more than they did, along whatever axis: what a vertex goes along a diagonal counts half,
// which is no more than the larger of what it goes along its two axes.
WARMFRONT_INLINE void advance(const Displacements& moved, double magnitude, std::uint32_t slack,
                              NodeTravel& travel) {
  const Float4 mean = 0.5F * moved.least + 0.5F * moved.most;
  const Float4 width = moved.most - moved.least;
  std::uint32_t units = travel::units(0.5F * std::max({0.0F, width[0], width[1], width[2]})) + slack;
  // The vertices may come back and the sum not, so that it would lose its last bits in time: then it starts
  // anew, and no budget outlives that. Nor does one what is not a number.
  const auto farthest = static_cast<float>(2 * magnitude);
  for (int k = 0; k < 3; ++k) {
    travel.centre[k] += mean[k];
    if (std::fabs(travel.centre[k]) <= farthest) continue;
    travel.centre[k] = 0;
    units = travel::kMost;
  }
  travel.wandered += std::min(units, travel::kMost);
}

// Of a leaf with blocks, and theirs.
template <class Bounds>
WARMFRONT_INLINE void advance_leaf(std::span<const PointBounds> bounds, double magnitude, Bvh<Bounds>& bvh,
                                   NodeId node) {
  const auto [first, end] = bvh.leaves.blocks_of[number_of(bvh.shape.leaf_of(node))];
  Displacements of_leaf;
  for (BlockId block = first; block < end; ++block) {
    const std::uint32_t b = number_of(block);
    Displacements moved;
    for (std::uint32_t left = bvh.travel.first_corners[b]; left != 0; left &= left - 1) {
      const auto corner = static_cast<std::uint32_t>(std::countr_zero(left));
      moved.see(bounds[bvh.leaves.corners[b].vertex[corner / 8][corner % 8]]);
    }
    if (!bvh.travel.blocks.empty()) advance(moved, magnitude, bvh.travel.slack, bvh.travel.blocks[b]);
    of_leaf.see(moved);
  }
  advance(of_leaf, magnitude, bvh.travel.slack, bvh.travel.nodes[number_of(node)]);
}

// Adds the step's motion of a node whose bounds are those of the step. Lanes that are infinite, whose changes
// are not numbers, come with a slack that outlives no budget.
template <class Bounds>
WARMFRONT_INLINE void advance_travel(std::span<const PointBounds> vertex_bounds, double magnitude,
                                     Bvh<Bounds>& bvh, NodeId node) {
  const NodeId first_leaf = bvh.shape.first_leaf();
  NodeTravel& travel = bvh.travel.nodes[number_of(node)];
  if (node >= first_leaf && !bvh.leaves.blocks.empty())
    return advance_leaf(vertex_bounds, magnitude, bvh, node);
  const Bounds& bounds = bvh.nodes[number_of(node)];
  const std::array<float, 3> centre = centre_of(bounds);
  const float length = wandered(bounds, centre[0] - travel.centre[0], centre[1] - travel.centre[1],
                                centre[2] - travel.centre[2]);
  travel.centre = centre;
  travel.wandered += std::min(travel::units(length) + bvh.travel.slack, travel::kMost);
}

}  // namespace warmfront

// SPDX-License-Identifier: Apache-2.0
// Refit in vector registers: the inlined core, from the bounds of vertices to those of leaves. Only for
// sources that dispatch by instruction set.
#pragma once

#include <algorithm>
#include <cstring>
#include <limits>
#include <span>
#include <tuple>

#include "engine/bounds/bounds_lanes.h"
#include "engine/bounds/eight_points.h"
#include "engine/bvh/bvh.h"

namespace warmfront {

// Bounds in registers: their lanes from kFrom on, 0 for both ends of the step or kEnd for t = 1 only. Whole
// vectors, of which the last one overlaps the one before. In registers, because reading memory in other
// pieces than it was written in stalls on the stores.
template <class Bounds, std::size_t kFrom>
struct Lanes {
  static constexpr std::size_t kTotal = std::tuple_size_v<decltype(Bounds::lane)>;
  static constexpr std::size_t kCount = (kTotal - kFrom + 7) / 8;
  static_assert(kTotal - kFrom >= 8);
  static constexpr std::size_t lane_of(std::size_t i) { return i + 1 < kCount ? kFrom + 8 * i : kTotal - 8; }

  Float8 of[kCount];

  /// Lanes of Bounds::empty().
  WARMFRONT_INLINE Lanes() {
#pragma GCC unroll 8
    for (std::size_t i = 0; i < kCount; ++i) of[i] = Float8{} + std::numeric_limits<float>::max();
  }
  WARMFRONT_INLINE explicit Lanes(const Bounds& bounds) {
#pragma GCC unroll 8
    for (std::size_t i = 0; i < kCount; ++i) of[i] = load<Float8>(&bounds.lane[lane_of(i)]);
  }
  WARMFRONT_INLINE void merge(const Lanes& other) {
#pragma GCC unroll 8
    for (std::size_t i = 0; i < kCount; ++i) of[i] = lesser(of[i], other.of[i]);
  }
  WARMFRONT_INLINE void store(Bounds& bounds) const {
#pragma GCC unroll 8
    for (std::size_t i = 0; i < kCount; ++i) std::memcpy(&bounds.lane[lane_of(i)], &of[i], sizeof of[i]);
  }
};

// The first lane that a step changes, given the step before. An AABB's halves are less than a vector: both
// are recomputed.
template <class Bounds>
inline constexpr std::size_t kNewLanes = Bounds::kEnd >= 8 ? Bounds::kEnd : 0;

// The least number of each of eight rows, in a row.
WARMFRONT_INLINE Float8 least_of_each(const Float8 (&row)[8]) {
  Float8 four[4];
#pragma GCC unroll 8
  for (int i = 0; i < 4; ++i) {
    const Float8 a = row[2 * i];
    const Float8 b = row[2 * i + 1];
    four[i] = lesser(shuffle<0, 8, 2, 10, 4, 12, 6, 14>(a, b), shuffle<1, 9, 3, 11, 5, 13, 7, 15>(a, b));
  }
  Float8 two[2];
#pragma GCC unroll 8
  for (int i = 0; i < 2; ++i) {
    const Float8 a = four[2 * i];
    const Float8 b = four[2 * i + 1];
    two[i] = lesser(shuffle<0, 1, 8, 9, 4, 5, 12, 13>(a, b), shuffle<2, 3, 10, 11, 6, 7, 14, 15>(a, b));
  }
  return lesser(shuffle<0, 1, 2, 3, 8, 9, 10, 11>(two[0], two[1]),
                shuffle<4, 5, 6, 7, 12, 13, 14, 15>(two[0], two[1]));
}

// The bounds of eight primitives at one end of the step, before quantisation: one row per end of a slab, in
// the order of Slabs::lane.
template <class Bounds>
struct EightEnds {
  static constexpr std::size_t kAxes = Bounds::kAxes;
  alignas(32) float row[2 * kAxes][8];

  // The bounds of eight triangles.
  WARMFRONT_INLINE void take(std::span<const PointBounds> points, const EightCorners& corners,
                             std::size_t t) {
    const EightPoints a(points, corners.vertex[0], t);
    const EightPoints b(points, corners.vertex[1], t);
    const EightPoints c(points, corners.vertex[2], t);
#pragma GCC unroll 9
    for (std::size_t k = 0; k < kAxes; ++k) {
      const auto of_a = slab_ends(k, a.x, a.y, a.z, a.margin);
      const auto of_b = slab_ends(k, b.x, b.y, b.z, b.margin);
      const auto of_c = slab_ends(k, c.x, c.y, c.z, c.margin);
      put(k, lesser(lesser(of_a.lower, of_b.lower), of_c.lower));
      put(kAxes + k, lesser(lesser(of_a.upper, of_b.upper), of_c.upper));
    }
  }

  WARMFRONT_INLINE void put(std::size_t lane, Float8 eight) {
    std::memcpy(row[lane], &eight, sizeof eight);
  }

  // Sets one slot's lanes at one end.
  WARMFRONT_INLINE void set(std::uint32_t slot, const float* lanes) {
    for (std::size_t lane = 0; lane < 2 * kAxes; ++lane) row[lane][slot] = lanes[lane];
  }

  // The union of all.
  WARMFRONT_INLINE void sum(float* lanes) const {
    constexpr std::size_t kLanes = 2 * kAxes;
    for (std::size_t group = 0; group < kLanes; group += 8) {
      const std::size_t from = kLanes < 8 || group + 8 <= kLanes ? group : kLanes - 8;
      Float8 rows[8];
#pragma GCC unroll 8
      for (std::size_t i = 0; i < 8; ++i) rows[i] = load<Float8>(row[from + i < kLanes ? from + i : 0]);
      const Float8 least = least_of_each(rows);
      std::memcpy(lanes + from, &least, (kLanes < 8 ? kLanes : 8) * sizeof(float));
    }
  }

  // Writes them as numbers of their leaf.
  WARMFRONT_INLINE void put(const LeafGrid<Bounds>& grid, std::size_t t, EightBounds<Bounds>& eight) const {
    auto* to = const_cast<std::int16_t*>(row_of(eight, grid.begin_at_1, t, 0));
    const auto& end = grid.end[t];
    if (end.none()) {
      std::fill_n(to, 16 * kAxes, grid.kNever);
      return;
    }
    const float scale = grid.power(-end.exponent);
#pragma GCC unroll 9
    for (std::size_t k = 0; k < kAxes; ++k) {
      const Int8 low = numbers((load<Float8>(row[k]) - end.origin[k]) * scale);
      const Int8 high = numbers((load<Float8>(row[kAxes + k]) + end.origin[k]) * scale);
      const Int8 pairs = (high << 16) | (low & 0xffff);
      std::memcpy(to + 16 * k, &pairs, sizeof pairs);
    }
  }

 private:
  // See grid_floor().
  WARMFRONT_INLINE static Int8 numbers(Float8 units) {
    return to_ints(units + kGridUp) - kGridBase;
  }
};

// What a refit makes of bounds: both ends, t = 1 after what was there has become t = 0, or t = 1 alone.
enum class Ends : std::uint8_t { kBoth, kNext, kLast };

// A leaf's bounds, and those of its blocks and primitives.
template <Ends kEnds, class Bounds>
WARMFRONT_INLINE void refit_leaf(std::span<const PointBounds> points, Bvh<Bounds>& bvh, NodeId node) {
  constexpr std::size_t kLanes = Bounds::kEnd;
  const std::uint32_t leaf = number_of(bvh.shape.leaf_of(node));
  const auto [first, end] = bvh.leaves.blocks_of[leaf];
  const std::uint32_t count = end - first;
  LeafGrid<Bounds>& grid = bvh.leaves.grids[leaf];
  if constexpr (kEnds == Ends::kBoth) grid.begin_at_1 = Bounds::kAxes;
  if constexpr (kEnds == Ends::kNext) grid.shift();
  EightEnds<Bounds> primitives[8];
  EightEnds<Bounds> sums;
  for (std::size_t t = kEnds == Ends::kBoth ? 0 : 1; t < 2; ++t) {
    for (std::uint32_t b = 0; b < count; ++b) {
      primitives[b].take(points, bvh.leaves.corners[number_of(first + b)], t);
      float sum[kLanes];
      primitives[b].sum(sum);
      sums.set(b, sum);
    }
    for (std::uint32_t b = count; b < 8; ++b)  // empty slots repeat the first
      for (auto& row : sums.row) row[b] = row[0];
    sums.sum(bvh.nodes[number_of(node)].lane.data() + t * kLanes);
    grid.set(bvh.nodes[number_of(node)], t);
    for (std::uint32_t b = 0; b < count; ++b)
      primitives[b].put(grid, t, bvh.leaves.blocks[number_of(first + b)]);
    if (!bvh.leaves.wide.empty()) sums.put(grid, t, bvh.leaves.wide[leaf]);
  }
}

}  // namespace warmfront

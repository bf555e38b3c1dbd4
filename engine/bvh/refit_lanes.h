// SPDX-License-Identifier: Apache-2.0
// Refit in vector registers: the inlined core, from the bounds of vertices to those of leaves. Only for
// sources that dispatch by instruction set.
#pragma once

#include <algorithm>
#include <cstring>
#include <limits>
#include <span>
#include <tuple>

#include "engine/bounds/lanes.h"
#include "engine/bvh/bvh.h"

namespace warmfront {

// Bounds in registers: their lanes from kFrom on, 0 for both ends of the step or kEnd for t = 1 alone. Whole
// vectors, of which the last takes some lanes again. In registers, because bounds that are read from memory
// in other pieces than they were written in wait for their stores.
template <class Bounds, std::size_t kFrom>
struct Lanes {
  static constexpr std::size_t kTotal = std::tuple_size_v<decltype(Bounds::lane)>;
  static constexpr std::size_t kCount = (kTotal - kFrom + 7) / 8;
  static_assert(kTotal - kFrom >= 8);
  static constexpr std::size_t lane_of(std::size_t i) { return i + 1 < kCount ? kFrom + 8 * i : kTotal - 8; }

  Float8 of[kCount];

  /// Of Bounds::empty().
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

// Where the lanes begin that a step changes, given those of the step before. An AABB's halves are less than a
// vector: both are made.
template <class Bounds>
inline constexpr std::size_t kNewLanes = Bounds::kEnd >= 8 ? Bounds::kEnd : 0;

template <class Bounds, std::size_t kFrom>
struct OfVertices;

template <std::size_t kFrom>
struct OfVertices<KDop18, kFrom> {
  WARMFRONT_INLINE static Lanes<KDop18, kFrom> merged(std::span<const KDop18> of, const Face& vertices) {
    Lanes<KDop18, kFrom> lanes(of[vertices[0]]);
    lanes.merge(Lanes<KDop18, kFrom>(of[vertices[1]]));
    lanes.merge(Lanes<KDop18, kFrom>(of[vertices[2]]));
    return lanes;
  }
};

template <std::size_t kFrom>
struct OfVertices<Aabb, kFrom> {
  WARMFRONT_INLINE static Lanes<Aabb, kFrom> merged(std::span<const KDop18> of, const Face& vertices) {
    using Float4 = float __attribute__((vector_size(16)));
    // Each end's lower and upper three, as narrow() picks them, with one lane more.
    const auto three = [&](std::size_t lane) {
      return lesser(
          lesser(load<Float4>(&of[vertices[0]].lane[lane]), load<Float4>(&of[vertices[1]].lane[lane])),
          load<Float4>(&of[vertices[2]].lane[lane]));
    };
    const Float4 a = three(0);
    const Float4 b = three(9);
    const Float4 c = three(18);
    const Float4 d = three(27);
    Lanes<Aabb, kFrom> lanes;
    const Float8 ab = __builtin_shufflevector(a, b, 0, 1, 2, 4, 5, 6, 6, 6);
    const Float8 cd = __builtin_shufflevector(c, d, 0, 1, 2, 4, 5, 6, 6, 6);
    lanes.of[0] = __builtin_shufflevector(ab, cd, 0, 1, 2, 3, 4, 5, 8, 9);
    lanes.of[1] = __builtin_shufflevector(ab, cd, 4, 5, 8, 9, 10, 11, 12, 13);
    return lanes;
  }
};

// Eight rows of eight lanes become eight lanes of eight rows.
WARMFRONT_INLINE void transpose(Float8 (&r)[8]) {
  Float8 s[8];
#pragma GCC unroll 8
  for (int i = 0; i < 8; i += 2) {
    s[i] = __builtin_shuffle(r[i], r[i + 1], Int8{0, 8, 2, 10, 4, 12, 6, 14});
    s[i + 1] = __builtin_shuffle(r[i], r[i + 1], Int8{1, 9, 3, 11, 5, 13, 7, 15});
  }
#pragma GCC unroll 8
  for (int i = 0; i < 8; i += 4) {
#pragma GCC unroll 8
    for (int k = 0; k < 2; ++k) {
      r[i + k] = __builtin_shuffle(s[i + k], s[i + k + 2], Int8{0, 1, 8, 9, 4, 5, 12, 13});
      r[i + k + 2] = __builtin_shuffle(s[i + k], s[i + k + 2], Int8{2, 3, 10, 11, 6, 7, 14, 15});
    }
  }
#pragma GCC unroll 8
  for (int k = 0; k < 4; ++k) {
    s[k] = __builtin_shuffle(r[k], r[k + 4], Int8{0, 1, 2, 3, 8, 9, 10, 11});
    s[k + 4] = __builtin_shuffle(r[k], r[k + 4], Int8{4, 5, 6, 7, 12, 13, 14, 15});
  }
#pragma GCC unroll 8
  for (int i = 0; i < 8; ++i) r[i] = s[i];
}

// Lower ends and negated upper ends, in units from their origin, as pairs of 16 bits; each as grid_floor().
WARMFRONT_INLINE Float8 pairs_of(Float8 lower, Float8 upper) {
  const Int8 low = __builtin_convertvector(lower + kGridUp, Int8) - kGridBase;
  const Int8 high = __builtin_convertvector(upper + kGridUp, Int8) - kGridBase;
  return (Float8)((high << 16) | (low & 0xffff));
}

// The bounds of up to eight, one by one, until they are numbers of their leaf.
template <class Bounds, std::size_t kFrom>
class Rows {
 public:
  using Row = Lanes<Bounds, kFrom>;

  WARMFRONT_INLINE void set(std::uint32_t slot, const Row& row) {
#pragma GCC unroll 8
    for (std::size_t k = 0; k < Row::kCount; ++k)
      std::memcpy(&rows_[slot][8 * k], &row.of[k], sizeof row.of[k]);
  }
  /// Puts them in place of the numbers of the last step, which become those of t = 0.
  WARMFRONT_INLINE void put(const LeafGrid<Bounds>& grid, EightBounds<Bounds>& eight) {
    // Empty slots hold what the first does: numbers, whatever is made of them.
    for (std::uint32_t i = eight.count; i < EightBounds<Bounds>::kSlots; ++i)
      std::memcpy(rows_[i], rows_[0], sizeof rows_[i]);
    put_new(grid, eight);
    for (std::size_t t = kFrom > 0 ? 1 : 0; t < 2; ++t) {
      if (!grid.end[t].none()) continue;
      std::fill_n(rows_at(eight, grid, t), 16 * Bounds::kAxes, LeafGrid<Bounds>::kNever);
    }
  }

 private:
  // Where eight lanes from `lane` on stand in a row, or one.
  static constexpr std::size_t at(std::size_t lane) {
    return lane == Row::kTotal - 8 ? 8 * (Row::kCount - 1) : lane - kFrom;
  }

  WARMFRONT_INLINE static std::int16_t* rows_at(EightBounds<Bounds>& eight, const LeafGrid<Bounds>& grid,
                                                std::size_t t) {
    return const_cast<std::int16_t*>(row_of(eight, grid.begin_at_1, t, 0));
  }

  WARMFRONT_INLINE void put_new(const LeafGrid<KDop18>& grid, EightBounds<KDop18>& eight) const {
#pragma GCC unroll 2
    for (std::size_t t = kFrom > 0 ? 1 : 0; t < 2; ++t) {
      const std::size_t lower = t * KDop18::kEnd;
      const std::size_t upper = lower + KDop18::kAxes;
      const auto& end = grid.end[t];
      const float scale = LeafGrid<KDop18>::power(-end.exponent);
      std::int16_t* to = rows_at(eight, grid, t);
      // All axes but the first, then the first of all eight.
      const Float8 origin = load<Float8>(&end.origin[1]);
      Float8 pairs[8];
#pragma GCC unroll 8
      for (std::size_t i = 0; i < 8; ++i)
        pairs[i] = pairs_of((load<Float8>(&rows_[i][at(lower + 1)]) - origin) * scale,
                            (load<Float8>(&rows_[i][at(upper + 1)]) + origin) * scale);
      transpose(pairs);
#pragma GCC unroll 8
      for (std::size_t k = 0; k < 8; ++k) std::memcpy(to + 16 * (k + 1), &pairs[k], sizeof pairs[k]);
      const auto first = [&](std::size_t lane) {
        const std::size_t k = lane - kFrom;
        return Float8{rows_[0][k], rows_[1][k], rows_[2][k], rows_[3][k],
                      rows_[4][k], rows_[5][k], rows_[6][k], rows_[7][k]};
      };
      const Float8 of_first =
          pairs_of((first(lower) - end.origin[0]) * scale, (first(upper) + end.origin[0]) * scale);
      std::memcpy(to, &of_first, sizeof of_first);
    }
  }

  WARMFRONT_INLINE void put_new(const LeafGrid<Aabb>& grid, EightBounds<Aabb>& eight) const {
    const auto& [o0, o1] = grid.end;
    const float s0 = LeafGrid<Aabb>::power(-o0.exponent);
    const float s1 = LeafGrid<Aabb>::power(-o1.exponent);
    const Float8 scale{s0, s0, s0, s1, s1, s1, s1, s1};
    const Float8 origin{o0.origin[0], o0.origin[1], o0.origin[2], o1.origin[0],
                        o1.origin[1], o1.origin[2], o1.origin[2], o1.origin[2]};
    Float8 pairs[8];
#pragma GCC unroll 8
    for (std::size_t i = 0; i < 8; ++i) {
      const Float8 a = load<Float8>(&rows_[i][0]);  // lanes 0 to 7
      const Float8 b = load<Float8>(&rows_[i][8]);  // lanes 4 to 11
      const Float8 lower = __builtin_shufflevector(a, b, 0, 1, 2, 6, 7, 12, 12, 12);
      const Float8 upper = __builtin_shufflevector(a, b, 3, 4, 5, 13, 14, 15, 15, 15);
      pairs[i] = pairs_of((lower - origin) * scale, (upper + origin) * scale);
    }
    transpose(pairs);
#pragma GCC unroll 8
    for (std::size_t k = 0; k < 6; ++k) std::memcpy(eight.row[k].data(), &pairs[k], sizeof pairs[k]);
  }

  alignas(32) float rows_[EightBounds<Bounds>::kSlots][8 * Row::kCount];
};

// A leaf's bounds, and those of its blocks and primitives.
template <std::size_t kFrom, class Bounds>
WARMFRONT_INLINE void refit_leaf(std::span<const KDop18> vertex_bounds, Bvh<Bounds>& bvh, NodeId node) {
  const NodeId leaf = node - bvh.shape.first_leaf();
  const bool wide = !bvh.wide.empty();
  const std::uint32_t count = wide ? bvh.wide[leaf].count : 1;
  LeafBlock<Bounds>* blocks = &bvh.blocks[wide ? bvh.wide[leaf].first : leaf];
  Rows<Bounds, kFrom> primitives[8];
  Rows<Bounds, kFrom> sums;
  Lanes<Bounds, kFrom> sum_of_all;
  for (std::uint32_t b = 0; b < count; ++b) {
    const LeafBlock<Bounds>& block = blocks[b];
    Lanes<Bounds, kFrom> sum;
    for (std::uint32_t i = 0; i < block.count; ++i) {
      const Lanes<Bounds, kFrom> row = OfVertices<Bounds, kFrom>::merged(
          vertex_bounds, {block.vertex[0][i], block.vertex[1][i], block.vertex[2][i]});
      sum.merge(row);
      primitives[b].set(i, row);
    }
    sum_of_all.merge(sum);
    sums.set(b, sum);
  }
  sum_of_all.store(bvh.nodes[node]);
  LeafGrid<Bounds>& grid = bvh.grids[leaf];
  if constexpr (kFrom > 0) {
    grid.shift();
  } else {
    grid.begin_at_1 = Bounds::kAxes;
    grid.set(bvh.nodes[node], 0);
  }
  grid.set(bvh.nodes[node], 1);
  for (std::uint32_t b = 0; b < count; ++b) primitives[b].put(grid, blocks[b]);
  if (wide) sums.put(grid, bvh.wide[leaf]);
}

}  // namespace warmfront

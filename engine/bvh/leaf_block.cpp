// SPDX-License-Identifier: Apache-2.0
#include "engine/bvh/leaf_block.h"

#include <bit>
#include <cstring>
#include <limits>

#include "engine/bounds/lanes.h"

namespace warmfront {
namespace {

using Int8 = std::int32_t __attribute__((vector_size(32)));
using Byte8 = std::uint8_t __attribute__((vector_size(8)));

constexpr Int8 kLaneBit{1, 2, 4, 8, 16, 32, 64, 128};

// One primitive against each lane of a block.
struct Row {
  Int8 apart;  // all ones where they are
  Float8 gap;  // at t = 1, along the axis along which it is widest (half of it along a diagonal)
};

// `one` is a function from lane number to value.
template <class When, class Bounds, class LaneOf>
WARMFRONT_INLINE Row against(When stays_open, const LeafBlock<Bounds>& block, LaneOf&& one) {
  constexpr int kAxes = Bounds::kAxes;
  constexpr int kEnd = Bounds::kEnd;
  const auto many = [&](int lane) { return load<Float8>(block.lane[lane].data()); };
  Float8 open{};  // positive where an axis keeps them apart, as gap() of lanes.h
  Float8 straight{};
  Float8 diagonal{};
  for (int k = 0; k < kAxes; ++k) {
    const Float8 below1 = one(k + kEnd) + many(k + kAxes + kEnd);
    const Float8 above1 = one(k + kAxes + kEnd) + many(k + kEnd);
    open = greater(
        greater(stays_open(one(k) + many(k + kAxes), below1), stays_open(one(k + kAxes) + many(k), above1)),
        open);
    Float8& widest = k < 3 ? straight : diagonal;
    widest = greater(greater(below1, above1), widest);
  }
  return {(Int8)(open > 0.0F), greater(straight, 0.5F * diagonal)};
}

// One bit a lane.
WARMFRONT_INLINE std::uint32_t bits_of(Int8 lanes) {
  const auto words = (Long4)(lanes & kLaneBit);
  const auto both = static_cast<std::uint64_t>((words[0] | words[1]) | (words[2] | words[3]));
  return static_cast<std::uint32_t>(both | (both >> 32));
}

// Byte j is lane j.
WARMFRONT_INLINE std::uint64_t bytes_of(Int8 lanes) {
  const Byte8 bytes = __builtin_convertvector(lanes, Byte8);
  std::uint64_t packed;
  std::memcpy(&packed, &bytes, sizeof packed);
  return packed;
}

template <class When, class Bounds>
WARMFRONT_INLINE LeafOverlaps all_pairs(When open, const LeafBlock<Bounds>& a, const LeafBlock<Bounds>& b,
                                        const Bounds& node_b, bool same) {
  const Float8 far = Float8{} + std::numeric_limits<float>::max();
  const Int8 slot{0, 1, 2, 3, 4, 5, 6, 7};
  const Int8 used = slot < static_cast<std::int32_t>(b.count);
  Float8 gap = far;
  std::uint32_t rows = (1U << a.count) - 1;
  if (!same) {
    const Row row = against(open, a, [&](int k) { return node_b.lane[k]; });
    const Int8 out = row.apart & (slot < static_cast<std::int32_t>(a.count));
    gap = out ? row.gap : far;
    rows &= ~bits_of(out);
  }
  Int8 to_test{};
  for (; rows != 0; rows &= rows - 1) {
    const int i = std::countr_zero(rows);
    const auto bit = static_cast<std::int32_t>(rows & -rows);
    Int8 shared{};
    for (int p = 0; p < 3; ++p) {
      const auto vertex = static_cast<std::int32_t>(a.vertex[p][i]);
      for (int q = 0; q < 3; ++q) {
        Int8 others;
        std::memcpy(&others, b.vertex[q].data(), sizeof others);
        shared |= others == vertex;
      }
    }
    const Int8 wanted = used & ~shared & (same ? slot > i : used);
    const Row row = against(open, b, [&](int k) { return a.lane[k][i]; });
    to_test |= wanted & ~row.apart & bit;
    gap = lesser(wanted ? row.gap : far, gap);
  }
  return {bytes_of(to_test), -largest(-gap)};
}

}  // namespace

WARMFRONT_TARGET_CLONES
LeafOverlaps leaf_overlaps(const LeafBlock<Aabb>& a, const LeafBlock<Aabb>& b, const Aabb& node_b,
                           bool same) {
  return all_pairs(Throughout{}, a, b, node_b, same);
}

WARMFRONT_TARGET_CLONES
LeafOverlaps leaf_overlaps(const LeafBlock<KDop18>& a, const LeafBlock<KDop18>& b, const KDop18& node_b,
                           bool same) {
  return all_pairs(Throughout{}, a, b, node_b, same);
}

WARMFRONT_TARGET_CLONES
LeafOverlaps leaf_overlaps(const LeafBlock<Aabb>& a, const LeafBlock<Aabb>& b, const Aabb& node_b, bool same,
                           float until) {
  return all_pairs(Until{until}, a, b, node_b, same);
}

WARMFRONT_TARGET_CLONES
LeafOverlaps leaf_overlaps(const LeafBlock<KDop18>& a, const LeafBlock<KDop18>& b, const KDop18& node_b,
                           bool same, float until) {
  return all_pairs(Until{until}, a, b, node_b, same);
}

}  // namespace warmfront

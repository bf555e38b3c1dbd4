// SPDX-License-Identifier: Apache-2.0
#include "engine/bvh/leaf_block.h"

#include <bit>
#include <cstring>

#include "engine/bounds/lanes.h"

namespace warmfront {
namespace {

using Int8 = std::int32_t __attribute__((vector_size(32)));
using Byte8 = std::uint8_t __attribute__((vector_size(8)));

constexpr Int8 kLaneBit{1, 2, 4, 8, 16, 32, 64, 128};

// All ones in the lanes whose primitive is apart from `one`, given as a function from lane number to value.
template <class Bounds, class LaneOf>
WARMFRONT_INLINE Int8 apart(const LeafBlock<Bounds>& block, LaneOf&& one) {
  constexpr int kAxes = Bounds::kAxes;
  constexpr int kEnd = Bounds::kEnd;
  const auto many = [&](int lane) { return load<Float8>(block.lane[lane].data()); };
  // As gap() of lanes.h. Two chains halve the latency.
  const auto below = [&](int k) {
    return lesser(one(k) + many(k + kAxes), one(k + kEnd) + many(k + kAxes + kEnd));
  };
  const auto above = [&](int k) {
    return lesser(one(k + kAxes) + many(k), one(k + kAxes + kEnd) + many(k + kEnd));
  };
  Float8 low = below(0);
  Float8 high = above(0);
  for (int k = 1; k < kAxes; ++k) {
    low = greater(low, below(k));
    high = greater(high, above(k));
  }
  return (Int8)(greater(low, high) > 0.0F);
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

// Bit 8 j + i for all i < j.
constexpr std::uint64_t kUpperTriangle = [] {
  std::uint64_t bits = 0;
  for (int j = 0; j < 8; ++j) bits |= ((std::uint64_t{1} << j) - 1) << (8 * j);
  return bits;
}();

template <class Bounds>
WARMFRONT_INLINE LeafOverlaps all_pairs(const LeafBlock<Bounds>& a, const LeafBlock<Bounds>& b,
                                        const Bounds& node_b, bool same) {
  std::uint32_t rows = (1U << a.count) - 1;
  if (!same) rows &= ~bits_of(apart(a, [&](int k) { return node_b.lane[k]; }));
  Int8 overlapping{};
  Int8 adjacent{};
  for (; rows != 0; rows &= rows - 1) {
    const int i = std::countr_zero(rows);
    const auto bit = static_cast<std::int32_t>(rows & -rows);
    overlapping |= ~apart(b, [&](int k) { return a.lane[k][i]; }) & bit;
    Int8 shared{};
    for (int p = 0; p < 3; ++p) {
      const auto vertex = static_cast<std::int32_t>(a.vertex[p][i]);
      for (int q = 0; q < 3; ++q) {
        Int8 others;
        std::memcpy(&others, b.vertex[q].data(), sizeof others);
        shared |= others == vertex;
      }
    }
    adjacent |= shared & bit;
  }
  const std::uint64_t used = b.count == 8 ? ~std::uint64_t{0} : (std::uint64_t{1} << (8 * b.count)) - 1;
  const std::uint64_t met = bytes_of(overlapping) & used & (same ? kUpperTriangle : ~std::uint64_t{0});
  const std::uint64_t shared = met & bytes_of(adjacent);
  return {met & ~shared, static_cast<std::uint32_t>(std::popcount(shared))};
}

}  // namespace

WARMFRONT_TARGET_CLONES
LeafOverlaps leaf_overlaps(const LeafBlock<Aabb>& a, const LeafBlock<Aabb>& b, const Aabb& node_b,
                           bool same) {
  return all_pairs(a, b, node_b, same);
}

WARMFRONT_TARGET_CLONES
LeafOverlaps leaf_overlaps(const LeafBlock<KDop18>& a, const LeafBlock<KDop18>& b, const KDop18& node_b,
                           bool same) {
  return all_pairs(a, b, node_b, same);
}

}  // namespace warmfront

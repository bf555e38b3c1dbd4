// SPDX-License-Identifier: Apache-2.0
#include "engine/bvh/leaf_block.h"

#include <bit>
#include <cstring>
#include <limits>

#include "engine/bounds/lanes.h"

namespace warmfront {
namespace {

using Byte8 = std::uint8_t __attribute__((vector_size(8)));

constexpr Int8 kLaneBit{1, 2, 4, 8, 16, 32, 64, 128};
constexpr Int8 kSlot{0, 1, 2, 3, 4, 5, 6, 7};
constexpr float kMost = std::numeric_limits<float>::max();
constexpr Float8 kFar{kMost, kMost, kMost, kMost, kMost, kMost, kMost, kMost};

// One primitive against each lane of a block.
struct Row {
  Int8 apart;  // all ones where they are
  Float8 gap;  // at t = 1, along the axis along which it is widest (half of it along a diagonal)
};

// `one` is a function from lane number to value.
template <class When, class Bounds, class LaneOf>
WARMFRONT_INLINE Row against(When stays_open, const EightBounds<Bounds>& eight, LaneOf&& one) {
  constexpr int kAxes = Bounds::kAxes;
  constexpr int kEnd = Bounds::kEnd;
  const auto many = [&](int lane) { return load<Float8>(eight.lane[lane].data()); };
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

// The items of `a` that are not apart from `whole_b`, as bits; the gap of the others goes into `gap`.
template <class When, class Bounds>
WARMFRONT_INLINE std::uint32_t rows_near(When open, const EightBounds<Bounds>& a, LanesOfOne whole_b,
                                         Float8& gap) {
  const Row row = against(open, a, whole_b);
  const Int8 out = row.apart & (kSlot < static_cast<std::int32_t>(a.count));
  gap = out ? row.gap : gap;
  return ((1U << a.count) - 1) & ~bits_of(out);
}

// The primitives of `b` that share a vertex with primitive i of `a`.
template <class Bounds>
WARMFRONT_INLINE Int8 sharing(const LeafBlock<Bounds>& a, int i, const LeafBlock<Bounds>& b) {
  Int8 shared{};
  for (int p = 0; p < 3; ++p) {
    const auto vertex = static_cast<std::int32_t>(a.vertex[p][i]);
    for (int q = 0; q < 3; ++q) {
      Int8 others;
      std::memcpy(&others, b.vertex[q].data(), sizeof others);
      shared |= others == vertex;
    }
  }
  return shared;
}

// Of the primitives of `b` that are near one of `a`, those that share no vertex with it; their gap counts.
// The others go into `adjacent`.
template <class Bounds>
WARMFRONT_INLINE Int8 sift(const LeafBlock<Bounds>& a, int i, const LeafBlock<Bounds>& b, Int8 near,
                           Float8 their_gap, Float8& gap, Int8& adjacent) {
  if (bits_of(near) == 0) return near;  // most rows: what shares a vertex is never apart
  const Int8 shared = near & sharing(a, i, b);
  adjacent |= shared;
  const Int8 free = near & ~shared;
  gap = lesser(free ? their_gap : kFar, gap);
  return free;
}

// Blocks that are near are looked into, and their primitives tell the gap.
template <class Bounds>
WARMFRONT_INLINE Int8 sift(const EightBounds<Bounds>&, int, const EightBounds<Bounds>&, Int8 near, Float8,
                           Float8&, Int8&) {
  return near;
}

// With `same`, item i of a meets those of b from i + `beyond` on.
template <class When, class Eight>
WARMFRONT_INLINE EightOverlaps all_pairs(When open, const Eight& a, const Eight& b, LanesOfOne whole_b,
                                         bool same, int beyond) {
  const Int8 used = kSlot < static_cast<std::int32_t>(b.count);
  Float8 gap = kFar;
  std::uint32_t rows = same ? (1U << a.count) - 1 : rows_near(open, a, whole_b, gap);
  Int8 to_test{};
  Int8 adjacent{};
  for (; rows != 0; rows &= rows - 1) {
    const int i = std::countr_zero(rows);
    const auto bit = static_cast<std::int32_t>(rows & -rows);
    const Int8 wanted = same ? used & (kSlot >= i + beyond) : used;
    const Row row = against(open, b, LanesOfOne::of(a, static_cast<std::uint32_t>(i)));
    gap = lesser(wanted & row.apart ? row.gap : kFar, gap);
    to_test |= sift(a, i, b, wanted & ~row.apart, row.gap, gap, adjacent) & bit;
  }
  return {bytes_of(to_test), -largest(-gap), bits_of(adjacent) != 0};
}

template <class Eight>
WARMFRONT_INLINE EightOverlaps overlaps(const Eight& a, const Eight& b, LanesOfOne whole_b, bool same,
                                        int beyond, float until) {
  return until < 1 ? all_pairs(Until{until}, a, b, whole_b, same, beyond)
                   : all_pairs(Throughout{}, a, b, whole_b, same, beyond);
}

}  // namespace

WARMFRONT_TARGET_CLONES
EightOverlaps primitive_overlaps(const LeafBlock<Aabb>& a, const LeafBlock<Aabb>& b, LanesOfOne whole_b,
                                 bool same, float until) {
  return overlaps(a, b, whole_b, same, 1, until);
}

WARMFRONT_TARGET_CLONES
EightOverlaps primitive_overlaps(const LeafBlock<KDop18>& a, const LeafBlock<KDop18>& b, LanesOfOne whole_b,
                                 bool same, float until) {
  return overlaps(a, b, whole_b, same, 1, until);
}

WARMFRONT_TARGET_CLONES
EightOverlaps block_overlaps(const EightBounds<Aabb>& a, const EightBounds<Aabb>& b, LanesOfOne whole_b,
                             bool same, float until) {
  return overlaps(a, b, whole_b, same, 0, until);
}

WARMFRONT_TARGET_CLONES
EightOverlaps block_overlaps(const EightBounds<KDop18>& a, const EightBounds<KDop18>& b, LanesOfOne whole_b,
                             bool same, float until) {
  return overlaps(a, b, whole_b, same, 0, until);
}

}  // namespace warmfront

// SPDX-License-Identifier: Apache-2.0
#include "engine/bounds/overlap.h"

#include <cstring>

#include "engine/target_clones.h"

namespace warmfront {
namespace {

// Vectors of the compiler's: one register where the instruction set has it, two or more where it has not.
using Float8 = float __attribute__((vector_size(32)));
using Float4 = float __attribute__((vector_size(16)));
using Long4 = long long __attribute__((vector_size(32)));
using Long2 = long long __attribute__((vector_size(16)));

template <class Vector>
WARMFRONT_INLINE Vector load(const float* from) {
  Vector v;
  std::memcpy(&v, from, sizeof v);
  return v;
}

// An 18-DOP in registers: the first eight lower and upper lanes, and the ninth of each.
struct Registers {
  Float8 lower;
  Float8 upper;
  float lower9;
  float upper9;
};

WARMFRONT_INLINE Registers registers(const KDop18& k) {
  return {load<Float8>(&k.lane[0]), load<Float8>(&k.lane[9]), k.lane[8], k.lane[17]};
}

WARMFRONT_INLINE Registers merged(const Registers& a, const Registers& b) {
  return {a.lower < b.lower ? a.lower : b.lower, a.upper < b.upper ? a.upper : b.upper,
          a.lower9 < b.lower9 ? a.lower9 : b.lower9, a.upper9 < b.upper9 ? a.upper9 : b.upper9};
}

WARMFRONT_INLINE bool meet(const Registers& a, const Registers& b) {
  const auto apart = (Long4)((a.lower + b.upper > 0.0F) | (a.upper + b.lower > 0.0F));
  return ((apart[0] | apart[1]) | (apart[2] | apart[3])) == 0 &&
         ((a.lower9 + b.upper9 > 0.0F) | (a.upper9 + b.lower9 > 0.0F)) == 0;
}

// An AABB's six lanes, as two overlapping vectors: lanes 0-3 hold the lower ends and 2-5 the upper ones.
WARMFRONT_INLINE bool meet(const Aabb& a, const Aabb& b) {
  const auto apart =
      (Long2)((load<Float4>(&a.lane[0]) + Float4{b.lane[3], b.lane[4], b.lane[5], b.lane[0]} > 0.0F));
  return (apart[0] | apart[1]) == 0 && ((a.lane[4] + b.lane[1] > 0.0F) | (a.lane[5] + b.lane[2] > 0.0F)) == 0;
}

WARMFRONT_INLINE bool meet(const KDop18& a, const KDop18& b) {
  return meet(registers(a), registers(b));
}

template <class Bounds>
WARMFRONT_INLINE std::uint32_t meet_many(const Bounds& one, std::span<const Bounds> many) {
  std::uint32_t bits = 0;
  for (std::size_t j = 0; j < many.size(); ++j) bits |= static_cast<std::uint32_t>(meet(one, many[j])) << j;
  return bits;
}

}  // namespace

WARMFRONT_TARGET_CLONES
bool overlap(const Aabb& a, const Aabb& b) {
  return meet(a, b);
}

WARMFRONT_TARGET_CLONES
bool overlap(const KDop18& a, const KDop18& b) {
  return meet(a, b);
}

WARMFRONT_TARGET_CLONES
std::uint32_t overlaps(const Aabb& one, std::span<const Aabb> many) {
  return meet_many(one, many);
}

WARMFRONT_TARGET_CLONES
std::uint32_t overlaps(const KDop18& one, std::span<const KDop18> many) {
  return meet_many(one, many);
}

WARMFRONT_TARGET_CLONES
std::uint32_t overlapping_features(const TriangleBounds& f, const TriangleBounds& g, std::uint32_t wanted) {
  const Registers vf[3] = {registers(*f.vertex[0]), registers(*f.vertex[1]), registers(*f.vertex[2])};
  const Registers vg[3] = {registers(*g.vertex[0]), registers(*g.vertex[1]), registers(*g.vertex[2])};
  std::uint32_t bits = 0;
  if ((wanted & 7U) != 0) {
    const Registers face = merged(merged(vg[0], vg[1]), vg[2]);
    for (int i = 0; i < 3; ++i) bits |= static_cast<std::uint32_t>(meet(vf[i], face)) << i;
  }
  if ((wanted & 070U) != 0) {
    const Registers face = merged(merged(vf[0], vf[1]), vf[2]);
    for (int i = 0; i < 3; ++i) bits |= static_cast<std::uint32_t>(meet(vg[i], face)) << (3 + i);
  }
  if ((wanted >> 6) != 0) {
    const Registers edges[3] = {merged(vg[0], vg[1]), merged(vg[1], vg[2]), merged(vg[2], vg[0])};
    for (int i = 0; i < 3; ++i) {
      if (((wanted >> (6 + 3 * i)) & 7U) == 0) continue;
      const Registers edge = merged(vf[i], vf[(i + 1) % 3]);
      for (int j = 0; j < 3; ++j) bits |= static_cast<std::uint32_t>(meet(edge, edges[j])) << (6 + 3 * i + j);
    }
  }
  return bits & wanted;
}

}  // namespace warmfront

// SPDX-License-Identifier: Apache-2.0
// Bounds in vector registers: the inlined core of all overlap tests. Only for sources that dispatch by
// instruction set.
#pragma once

#include <cstring>

#include "engine/bounds/kdop.h"
#include "engine/target_clones.h"

namespace warmfront {

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

}  // namespace warmfront

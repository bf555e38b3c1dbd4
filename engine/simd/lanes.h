// SPDX-License-Identifier: Apache-2.0
// Vectors of several numbers, one per lane, and their operations. Only for sources that dispatch by
// instruction set, which use no other SIMD code.
#pragma once

#include <cstdint>
#include <cstring>

#include "engine/simd/target_clones.h"

namespace warmfront {

// The compiler's vector types: one register where the instruction set has it, else two or more.
using Byte8 = std::uint8_t __attribute__((vector_size(8)));
using Short16 = std::int16_t __attribute__((vector_size(32)));
using Int4 = std::int32_t __attribute__((vector_size(16)));
using UInt4 = std::uint32_t __attribute__((vector_size(16)));
using Int8 = std::int32_t __attribute__((vector_size(32)));
using Long4 = long long __attribute__((vector_size(32)));
using Float4 = float __attribute__((vector_size(16)));
using Float8 = float __attribute__((vector_size(32)));
using Double4 = double __attribute__((vector_size(32)));

template <class Vector, class Element>
WARMFRONT_INLINE Vector load(const Element* from) {
  Vector v;
  std::memcpy(&v, from, sizeof v);
  return v;
}

template <class Vector>
WARMFRONT_INLINE Vector lesser(Vector a, Vector b) {
  return a < b ? a : b;
}

template <class Vector>
WARMFRONT_INLINE Vector greater(Vector a, Vector b) {
  return a > b ? a : b;
}

template <class Vector>
WARMFRONT_INLINE Vector magnitude(Vector x) {
  return greater(x, -x);
}

WARMFRONT_INLINE float largest(Float8 x) {
  x = greater(x, __builtin_shuffle(x, Int8{4, 5, 6, 7, 0, 1, 2, 3}));
  x = greater(x, __builtin_shuffle(x, Int8{2, 3, 0, 1, 6, 7, 4, 5}));
  x = greater(x, __builtin_shuffle(x, Int8{1, 0, 3, 2, 5, 4, 7, 6}));
  return x[0];
}

// Bitwise or of all lanes: the even ones in the low half, the odd ones in the high.
WARMFRONT_INLINE std::uint64_t ored_by_two(Int8 lanes) {
  const auto words = (Long4)lanes;
  return static_cast<std::uint64_t>((words[0] | words[1]) | (words[2] | words[3]));
}
WARMFRONT_INLINE std::uint32_t ored(Int8 lanes) {
  const std::uint64_t both = ored_by_two(lanes);
  return static_cast<std::uint32_t>(both | (both >> 32));
}
WARMFRONT_INLINE bool any(Int8 lanes) {
  return ored_by_two(lanes) != 0;
}

// One bit a lane, for lanes that are all ones or all zeros.
inline constexpr Int8 kLaneBit{1, 2, 4, 8, 16, 32, 64, 128};
WARMFRONT_INLINE std::uint32_t bits_of(Int8 lanes) {
  return ored(lanes & kLaneBit);
}

}  // namespace warmfront

// SPDX-License-Identifier: Apache-2.0
// Vectors of several numbers, one per lane, and their operations. Only for sources that dispatch by
// instruction set, which use no other SIMD code.
#pragma once

#include <cstdint>
#include <cstring>

#include "engine/simd/halves.h"
#include "engine/simd/target_clones.h"

namespace warmfront {

// The compiler's vector types, of one register.
using Byte8 = std::uint8_t __attribute__((vector_size(8)));
using Int4 = std::int32_t __attribute__((vector_size(16)));
using UInt4 = std::uint32_t __attribute__((vector_size(16)));
using Float4 = float __attribute__((vector_size(16)));
#if defined(WARMFRONT_REGISTERS_OF_16_BYTES)
using Short16 = Halves<std::int16_t __attribute__((vector_size(16)))>;
using Int8 = Halves<Int4>;
using Float8 = Halves<Float4>;
using Double4 = Halves<double __attribute__((vector_size(16)))>;
using Long4 = decltype(Double4() < Double4());
#else
using Short16 = std::int16_t __attribute__((vector_size(32)));
using Int8 = std::int32_t __attribute__((vector_size(32)));
using Long4 = long long __attribute__((vector_size(32)));
using Float8 = float __attribute__((vector_size(32)));
using Double4 = double __attribute__((vector_size(32)));
#endif

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

/// a in lanes that are all ones, b in those that are all zeros.
template <class Mask, class Vector>
WARMFRONT_INLINE Vector select(Mask mask, Vector a, Vector b) {
  return mask ? a : b;
}

/// Lanes of a, and after them of b, by number.
template <int... kLane, class Vector>
WARMFRONT_INLINE Vector shuffle(Vector a, Vector b) {
  return __builtin_shufflevector(a, b, kLane...);
}

#if defined(WARMFRONT_REGISTERS_OF_16_BYTES)
WARMFRONT_INLINE Float8 joined(Float4 low, Float4 high) {
  return {low, high};
}
/// Eight of four lanes, by number.
template <int kA, int kB, int kC, int kD, int... kRest>
WARMFRONT_INLINE Float8 spread(Float4 x) {
  return {__builtin_shufflevector(x, x, kA, kB, kC, kD), __builtin_shufflevector(x, x, kRest...)};
}

// Conversions of numbers.
WARMFRONT_INLINE Float8 to_floats(Int8 x) {
  return {__builtin_convertvector(x.low, Float4), __builtin_convertvector(x.high, Float4)};
}
WARMFRONT_INLINE Int8 to_ints(Float8 x) {
  return {__builtin_convertvector(x.low, Int4), __builtin_convertvector(x.high, Int4)};
}
WARMFRONT_INLINE Float4 to_floats(Double4 x) {
  return Float4{static_cast<float>(x.low[0]), static_cast<float>(x.low[1]), static_cast<float>(x.high[0]),
                static_cast<float>(x.high[1])};
}
WARMFRONT_INLINE Double4 to_doubles(Float4 x) {
  return {double{x[0]}, double{x[1]}, double{x[2]}, double{x[3]}};
}
WARMFRONT_INLINE Byte8 to_bytes(Int8 x) {
  using Byte4 = std::uint8_t __attribute__((vector_size(4)));
  return __builtin_shufflevector(__builtin_convertvector(x.low, Byte4),
                                 __builtin_convertvector(x.high, Byte4), 0, 1, 2, 3, 4, 5, 6, 7);
}

WARMFRONT_INLINE float largest(Float8 x) {
  Float4 y = greater(x.low, x.high);
  y = greater(y, __builtin_shufflevector(y, y, 2, 3, 0, 1));
  y = greater(y, __builtin_shufflevector(y, y, 1, 0, 3, 2));
  return y[0];
}

// Bitwise or of all lanes: the even ones in the low half, the odd ones in the high.
WARMFRONT_INLINE std::uint64_t ored_by_two(Int8 lanes) {
  const auto words = (long long __attribute__((vector_size(16))))(lanes.low | lanes.high);
  return static_cast<std::uint64_t>(words[0] | words[1]);
}
#else
WARMFRONT_INLINE Float8 joined(Float4 low, Float4 high) {
  return __builtin_shufflevector(low, high, 0, 1, 2, 3, 4, 5, 6, 7);
}
/// Eight of four lanes, by number.
template <int... kLane>
WARMFRONT_INLINE Float8 spread(Float4 x) {
  return __builtin_shufflevector(x, x, kLane...);
}

// Conversions of numbers.
WARMFRONT_INLINE Float8 to_floats(Int8 x) {
  return __builtin_convertvector(x, Float8);
}
WARMFRONT_INLINE Int8 to_ints(Float8 x) {
  return __builtin_convertvector(x, Int8);
}
WARMFRONT_INLINE Float4 to_floats(Double4 x) {
  return __builtin_convertvector(x, Float4);
}
WARMFRONT_INLINE Double4 to_doubles(Float4 x) {
  return __builtin_convertvector(x, Double4);
}
WARMFRONT_INLINE Byte8 to_bytes(Int8 x) {
  return __builtin_convertvector(x, Byte8);
}

WARMFRONT_INLINE float largest(Float8 x) {
  x = greater(x, shuffle<4, 5, 6, 7, 0, 1, 2, 3>(x, x));
  x = greater(x, shuffle<2, 3, 0, 1, 6, 7, 4, 5>(x, x));
  x = greater(x, shuffle<1, 0, 3, 2, 5, 4, 7, 6>(x, x));
  return x[0];
}

// Bitwise or of all lanes: the even ones in the low half, the odd ones in the high.
WARMFRONT_INLINE std::uint64_t ored_by_two(Int8 lanes) {
  const auto words = (Long4)lanes;
  return static_cast<std::uint64_t>((words[0] | words[1]) | (words[2] | words[3]));
}
#endif

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

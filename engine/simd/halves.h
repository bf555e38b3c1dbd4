// SPDX-License-Identifier: Apache-2.0
// A vector of 32 bytes as two registers of 16, for instruction sets that have no larger ones: NEON, and SSE.
// Left to itself, GCC 12 makes two of a sum, and one instruction a lane of a comparison, a choice and a
// shuffle. Each operation is that of the compiler's vectors, and gives the same bits.
#pragma once

#include <array>
#include <cstddef>
#include <cstring>
#include <type_traits>
#include <utility>

#include "engine/simd/target_clones.h"

namespace warmfront {

/// `Half`: one of the compiler's vector types.
template <class Half>
struct Halves {
  using Element = std::remove_cvref_t<decltype(Half{}[0])>;
  static constexpr int kLanesOfHalf = static_cast<int>(sizeof(Half) / sizeof(Element));

  Half low;
  Half high;

  Halves() = default;
  WARMFRONT_INLINE constexpr Halves(Half l, Half h) : low(l), high(h) {}
  /// Lane by lane; those that are left out are 0.
  template <class... Lanes>
  requires((std::is_arithmetic_v<Lanes> && ...) && sizeof...(Lanes) > 0) WARMFRONT_INLINE
      constexpr Halves(Lanes... lanes)  // NOLINT: as the compiler's vectors are made
      : Halves(std::array<Element, 2 * kLanesOfHalf>{static_cast<Element>(lanes)...},
               std::make_integer_sequence<int, kLanesOfHalf>()) {}
  /// The same bits, as a cast of the compiler's vectors.
  template <class Other>
  requires(sizeof(Other) == sizeof(Half)) WARMFRONT_INLINE explicit Halves(const Halves<Other>& other)
      : low((Half)other.low), high((Half)other.high) {}

  WARMFRONT_INLINE Element operator[](int lane) const {
    return lane < kLanesOfHalf ? low[lane] : high[lane - kLanesOfHalf];
  }

 private:
  template <int... kLane>
  WARMFRONT_INLINE constexpr Halves(const std::array<Element, 2 * kLanesOfHalf>& all,
                                    std::integer_sequence<int, kLane...>)
      : low{all[kLane]...}, high{all[kLanesOfHalf + kLane]...} {}
};

// Operations on lanes, and of lanes and a number, which stands for itself in each.
#define WARMFRONT_LANEWISE(op)                                                                           \
  template <class Half>                                                                                  \
  WARMFRONT_INLINE constexpr auto operator op(const Halves<Half>& a, const Halves<Half>& b) {            \
    return Halves<decltype(a.low op b.low)>(a.low op b.low, a.high op b.high);                           \
  }                                                                                                      \
  template <class Half>                                                                                  \
  WARMFRONT_INLINE constexpr auto operator op(const Halves<Half>& a, typename Halves<Half>::Element b) { \
    return Halves<decltype(a.low op b)>(a.low op b, a.high op b);                                        \
  }                                                                                                      \
  template <class Half>                                                                                  \
  WARMFRONT_INLINE constexpr auto operator op(typename Halves<Half>::Element a, const Halves<Half>& b) { \
    return Halves<decltype(a op b.low)>(a op b.low, a op b.high);                                        \
  }
WARMFRONT_LANEWISE(+)
WARMFRONT_LANEWISE(-)
WARMFRONT_LANEWISE(*)
WARMFRONT_LANEWISE(/)
WARMFRONT_LANEWISE(&)
WARMFRONT_LANEWISE(|)
WARMFRONT_LANEWISE(^)
WARMFRONT_LANEWISE(<<)
WARMFRONT_LANEWISE(>>)
WARMFRONT_LANEWISE(<)
WARMFRONT_LANEWISE(<=)
WARMFRONT_LANEWISE(>)
WARMFRONT_LANEWISE(>=)
WARMFRONT_LANEWISE(==)
WARMFRONT_LANEWISE(!=)
#undef WARMFRONT_LANEWISE

template <class Half>
WARMFRONT_INLINE Halves<Half> operator-(const Halves<Half>& a) {
  return {-a.low, -a.high};
}
template <class Half>
WARMFRONT_INLINE Halves<Half> operator~(const Halves<Half>& a) {
  return {~a.low, ~a.high};
}
template <class Half>
WARMFRONT_INLINE Halves<Half>& operator|=(Halves<Half>& a, const Halves<Half>& b) {
  return a = a | b;
}
template <class Half>
WARMFRONT_INLINE Halves<Half>& operator&=(Halves<Half>& a, const Halves<Half>& b) {
  return a = a & b;
}

/// As mask ? a : b of the compiler's vectors.
template <class Mask, class Half>
WARMFRONT_INLINE Halves<Half> select(const Halves<Mask>& mask, const Halves<Half>& a, const Halves<Half>& b) {
  return {mask.low ? a.low : b.low, mask.high ? a.high : b.high};
}
template <class Half>
WARMFRONT_INLINE Halves<Half> lesser(const Halves<Half>& a, const Halves<Half>& b) {
  return {a.low < b.low ? a.low : b.low, a.high < b.high ? a.high : b.high};
}
template <class Half>
WARMFRONT_INLINE Halves<Half> greater(const Halves<Half>& a, const Halves<Half>& b) {
  return {a.low > b.low ? a.low : b.low, a.high > b.high ? a.high : b.high};
}

namespace halves {

// Which of the halves a.low, a.high, b.low, b.high has lane i of the two together; and those that lanes
// kFirst, ... are taken from: at most two.
template <int kLanesOfHalf>
constexpr int half_of(int i) {
  return i / kLanesOfHalf;
}
template <int kLanesOfHalf, int... kLane>
constexpr std::array<int, 2> sources() {
  std::array<int, 2> of{-1, -1};
  for (const int half : {half_of<kLanesOfHalf>(kLane)...}) {
    if (of[0] < 0 || of[0] == half)
      of[0] = half;
    else if (of[1] < 0 || of[1] == half)
      of[1] = half;
    else
      return {-1, -1};
  }
  return {of[0], of[1] < 0 ? of[0] : of[1]};
}

template <int kHalf, class Half>
WARMFRONT_INLINE Half half(const Halves<Half>& a, const Halves<Half>& b) {
  if constexpr (kHalf == 0) return a.low;
  if constexpr (kHalf == 1) return a.high;
  if constexpr (kHalf == 2) return b.low;
  if constexpr (kHalf == 3) return b.high;
}

template <class Half, int... kLane>
WARMFRONT_INLINE Half shuffled(const Halves<Half>& a, const Halves<Half>& b) {
  constexpr int kOfHalf = Halves<Half>::kLanesOfHalf;
  constexpr std::array<int, 2> kFrom = sources<kOfHalf, kLane...>();
  static_assert(kFrom[0] >= 0, "of more than two registers: take two shuffles");
  return __builtin_shufflevector(half<kFrom[0]>(a, b), half<kFrom[1]>(a, b),
                                 (kLane % kOfHalf + (half_of<kOfHalf>(kLane) == kFrom[0] ? 0 : kOfHalf))...);
}

template <class Half, std::size_t... kFirst>
WARMFRONT_INLINE auto shuffled(const Halves<Half>& a, const Halves<Half>& b, auto lanes,
                               std::index_sequence<kFirst...>) {
  constexpr std::size_t kOfHalf = sizeof...(kFirst);
  constexpr auto kLanes = decltype(lanes)::kAll;
  return Halves<Half>(shuffled<Half, kLanes[kFirst]...>(a, b),
                      shuffled<Half, kLanes[kOfHalf + kFirst]...>(a, b));
}
template <int... kLane>
struct LaneList {
  static constexpr std::array<int, sizeof...(kLane)> kAll{kLane...};
};

}  // namespace halves

/// As __builtin_shufflevector(a, b, kLane...); each half of the result takes lanes of two halves.
template <int... kLane, class Half>
WARMFRONT_INLINE Halves<Half> shuffle(const Halves<Half>& a, const Halves<Half>& b) {
  static_assert(sizeof...(kLane) == 2 * Halves<Half>::kLanesOfHalf);
  return halves::shuffled(a, b, halves::LaneList<kLane...>(),
                          std::make_index_sequence<sizeof...(kLane) / 2>());
}

}  // namespace warmfront

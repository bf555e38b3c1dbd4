// SPDX-License-Identifier: Apache-2.0
// Vertices' bounds, eight at a time: the inlined core. Only for sources that dispatch by instruction set.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "engine/bounds/bounds_lanes.h"

namespace warmfront {

// Eight vertices at one end of the step.
struct EightPoints {
  Float8 x;
  Float8 y;
  Float8 z;
  Float8 margin;

  WARMFRONT_INLINE EightPoints(std::span<const PointBounds> points, const std::array<std::uint32_t, 8>& which,
                               std::size_t t) {
    const auto two = [&](std::size_t i) {
      const auto low = load<Float4>(points[which[i]].at[t].data());
      const auto high = load<Float4>(points[which[i + 4]].at[t].data());
      return joined(low, high);
    };
    const Float8 a = two(0);
    const Float8 b = two(1);
    const Float8 c = two(2);
    const Float8 d = two(3);
    const Float8 xy_ab = shuffle<0, 8, 1, 9, 4, 12, 5, 13>(a, b);
    const Float8 xy_cd = shuffle<0, 8, 1, 9, 4, 12, 5, 13>(c, d);
    const Float8 zm_ab = shuffle<2, 10, 3, 11, 6, 14, 7, 15>(a, b);
    const Float8 zm_cd = shuffle<2, 10, 3, 11, 6, 14, 7, 15>(c, d);
    x = shuffle<0, 1, 8, 9, 4, 5, 12, 13>(xy_ab, xy_cd);
    y = shuffle<2, 3, 10, 11, 6, 7, 14, 15>(xy_ab, xy_cd);
    z = shuffle<0, 1, 8, 9, 4, 5, 12, 13>(zm_ab, zm_cd);
    margin = shuffle<2, 3, 10, 11, 6, 7, 14, 15>(zm_ab, zm_cd);
  }
};

}  // namespace warmfront

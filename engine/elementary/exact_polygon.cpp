// SPDX-License-Identifier: Apache-2.0
#include "engine/elementary/exact_polygon.h"

#include <algorithm>
#include <bit>
#include <cstdint>

namespace warmfront {

CoordinateBits::CoordinateBits(const FeatureVertices& features) : lowest{}, span(0) {
  for (int axis = 0; axis < 3; ++axis) {
    int least = 2048;
    int greatest = -2048;
    for (const VertexMotion* vertex : features.vertex) {
      for (const double x : {vertex->t0[axis], vertex->t1[axis]}) {
        const auto bits = std::bit_cast<std::uint64_t>(x) << 1;
        if (bits == 0) continue;
        const auto exponent = static_cast<int>(bits >> 53);
        const int zeros = std::min(52, std::countr_zero(bits) - 1);
        least = std::min(least, std::max(exponent, 1) - 1075 + zeros);
        greatest = std::max(greatest, std::max(exponent, 1) - 1022);
      }
    }
    if (greatest < least) continue;
    lowest[axis] = least;
    span = std::max(span, greatest - least);
  }
}

}  // namespace warmfront

// SPDX-License-Identifier: Apache-2.0
#include "engine/elementary/exact_polygon.h"

#include <algorithm>
#include <bit>
#include <cstdint>

namespace warmfront {

namespace {

// The exponents of the lowest bit set in any of some doubles, and of a power of two above all of them.
struct Exponents {
  int least = 2048;
  int greatest = -2048;

  void add(double x) {
    const auto bits = std::bit_cast<std::uint64_t>(x) << 1;
    if (bits == 0) return;
    const auto exponent = static_cast<int>(bits >> 53);
    const int zeros = std::min(52, std::countr_zero(bits) - 1);
    least = std::min(least, std::max(exponent, 1) - 1075 + zeros);
    greatest = std::max(greatest, std::max(exponent, 1) - 1022);
  }
  void add(const FeatureVertices& features, int axis) {
    for (const VertexMotion* vertex : features.vertex) {
      add(vertex->t0[axis]);
      add(vertex->t1[axis]);
    }
  }
};

}  // namespace

CoordinateBits::CoordinateBits(const FeatureVertices& features) : lowest{}, span(0) {
  for (int axis = 0; axis < 3; ++axis) {
    Exponents exponents;
    exponents.add(features, axis);
    if (exponents.greatest < exponents.least) continue;
    lowest[axis] = exponents.least;
    span = std::max(span, exponents.greatest - exponents.least);
  }
}

CoordinateBits::CoordinateBits(const FeatureVertices& features, double length) : lowest{}, span(0) {
  Exponents exponents;
  exponents.add(length);
  for (int axis = 0; axis < 3; ++axis) exponents.add(features, axis);
  if (exponents.greatest < exponents.least) return;
  lowest.fill(exponents.least);
  span = exponents.greatest - exponents.least;
}

}  // namespace warmfront

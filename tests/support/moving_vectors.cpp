// SPDX-License-Identifier: Apache-2.0
#include "tests/support/moving_vectors.h"

#include <algorithm>
#include <bit>
#include <cstdint>

namespace warmfront::testing {

MovingVector operator-(const MovingVector& a, const MovingVector& b) {
  return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}

MovingVector cross(const MovingVector& a, const MovingVector& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

Polynomial dot(const MovingVector& a, const MovingVector& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

IntegerQuery integer_query(const FeatureVertices& features, double length) {
  unsigned long exponent = dyadic(length).exponent;
  for (const VertexMotion* v : features.vertex) {
    for (int axis = 0; axis < 3; ++axis) {
      exponent = std::max({exponent, dyadic(v->t0[axis]).exponent, dyadic(v->t1[axis]).exponent});
    }
  }
  const auto integer = [&](double x) {
    const Dyadic d = dyadic(x);
    mpz_class result;
    mpz_mul_2exp(result.get_mpz_t(), d.numerator.get_mpz_t(), exponent - d.exponent);
    return result;
  };
  IntegerQuery query;
  query.length = integer(length);
  for (int k = 0; k < 4; ++k) {
    for (int axis = 0; axis < 3; ++axis) {
      const mpz_class from = integer(features.vertex[k]->t0[axis]);
      const mpz_class to = integer(features.vertex[k]->t1[axis]);
      query.vertex[k][axis] = Polynomial({from, to - from});
    }
  }
  return query;
}

// Positive doubles are ordered as their bits.
double double_below(Root& root) {
  std::uint64_t below = 0;
  std::uint64_t above = std::bit_cast<std::uint64_t>(1.0) + 1;
  while (above - below > 1) {
    const std::uint64_t middle = below + (above - below) / 2;
    (compare(dyadic(std::bit_cast<double>(middle)), root) <= 0 ? below : above) = middle;
  }
  return std::bit_cast<double>(below);
}

}  // namespace warmfront::testing

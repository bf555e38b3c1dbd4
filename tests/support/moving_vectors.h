// SPDX-License-Identifier: Apache-2.0
// The vertices of an elementary query as vectors of polynomials in time, with integer coefficients: what the
// oracles calculate with. Pure functions.
#pragma once

#include <array>

#include "engine/elementary/query.h"
#include "tests/support/polynomial.h"

namespace warmfront::testing {

using MovingVector = std::array<Polynomial, 3>;

MovingVector operator-(const MovingVector& a, const MovingVector& b);
MovingVector cross(const MovingVector& a, const MovingVector& b);
Polynomial dot(const MovingVector& a, const MovingVector& b);

/// A query times one power of two that makes all its numbers integers.
struct IntegerQuery {
  std::array<MovingVector, 4> vertex;  ///< positions, of degree 1 in t
  mpz_class length;
};

/// Exact for any finite coordinates, with a length (a separation) in the same unit.
IntegerQuery integer_query(const FeatureVertices& features, double length);

/// The largest double not above the root, which is in (0, 1]. May refine it.
double double_below(Root& root);

}  // namespace warmfront::testing

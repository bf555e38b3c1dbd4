// SPDX-License-Identifier: Apache-2.0
// Where a query's vertices are at both ends of the step, and what families do to them. Pure functions of the
// generator given.
#pragma once

#include <array>
#include <random>

#include "tests/support/feature_case.h"

namespace warmfront::testing::torture {

using Random = std::mt19937_64;
using Point = std::array<double, 3>;

/// Where the vertices are at both ends of the step.
struct Ends {
  std::array<Point, 4> t0{};
  std::array<Point, 4> t1{};

  template <class Change>
  void each(Change&& change) {
    for (auto* points : {&t0, &t1}) {
      for (int k = 0; k < 4; ++k) {
        for (int axis = 0; axis < 3; ++axis) change((*points)[k][axis], k, axis);
      }
    }
  }
};

FeatureCase query_of(ContactKind kind, const Ends& ends);

/// From -bound to bound.
double integer(Random& random, int bound);
/// From -1 to 1.
double uniform(Random& random);

/// Where on the primitives they meet: inside both, or on their rims.
enum class Where { kAnywhere, kInside, kRim };

/// Integers below 2^20 in size such that the primitives meet at time `eighth` / 8, exactly, whatever they do
/// before.
struct Meeting {
  int eighth = 4;
  Where where = Where::kAnywhere;
  int size = 100;    // half the largest coordinate, in units of 64
  int motion = 100;  // half the largest displacement, in units of 8
};
Ends meeting(Random& random, ContactKind kind, const Meeting& m);

/// The same seen along other axes: three elementary shears, exact on the integers here.
void shear(Random& random, Ends& ends);
/// By a power of two.
void scale(Ends& ends, int exponent);
/// One coordinate to the next double, either way.
void push(Random& random, Ends& ends);

/// 0 to 8.
int any_eighth(Random& random);

}  // namespace warmfront::testing::torture

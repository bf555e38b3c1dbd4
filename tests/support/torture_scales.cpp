// SPDX-License-Identifier: Apache-2.0
// Numbers of any size, from denormals to the largest doubles.
#include <array>
#include <cmath>
#include <limits>

#include "tests/support/draws.h"
#include "tests/support/torture_families.h"

namespace warmfront::testing::torture {

FeatureCase general(Random& random, ContactKind kind) {
  Ends ends;
  ends.each([&](double& x, int, int) { x = uniform(random); });
  return query_of(kind, ends);
}

FeatureCase large_offset(Random& random, ContactKind kind) {
  Ends ends = meeting(random, kind, {.eighth = any_eighth(random), .size = 1, .motion = 8});
  Point offset;
  for (double& x : offset) x = std::ldexp(integer(random, 1), between(random, 10, 44) + 7);
  ends.each([&](double& x, int, int axis) { x += offset[axis]; });
  if (one_in(random, 2)) push(random, ends);
  return query_of(kind, ends);
}

FeatureCase extreme_scale(Random& random, ContactKind kind) {
  Ends ends = meeting(random, kind, {.eighth = any_eighth(random)});
  shear(random, ends);
  if (one_in(random, 3)) push(random, ends);
  scale(ends, between(random, -1040, 1000));
  return query_of(kind, ends);
}

FeatureCase uneven_axes(Random& random, ContactKind kind) {
  Ends ends = meeting(random, kind, {.eighth = any_eighth(random)});
  if (one_in(random, 3)) push(random, ends);
  const int range = one_in(random, 2) ? 50 : 950;
  std::array<int, 3> exponent;
  for (int& e : exponent) e = between(random, -range, range);
  ends.each([&](double& x, int, int axis) { x = std::ldexp(x, exponent[axis]); });
  return query_of(kind, ends);
}

// Faces and edges 2^45 times as long as wide: the far vertex lies beyond, close to the line of the others.
FeatureCase needle(Random& random, ContactKind kind) {
  Ends ends = meeting(random, kind, {.eighth = any_eighth(random), .size = 1, .motion = 1});
  Point far;
  for (double& x : far) x = std::ldexp(integer(random, 3), between(random, 40, 45));
  const int k = kind == ContactKind::kVertexFace ? between(random, 1, 3) : between(random, 0, 3);
  for (int axis = 0; axis < 3; ++axis) {
    ends.t0[k][axis] += far[axis];
    ends.t1[k][axis] += far[axis];
  }
  if (kind == ContactKind::kVertexFace && one_in(random, 2)) {  // the vertex near the needle's far part
    for (int axis = 0; axis < 3; ++axis) {
      ends.t0[0][axis] += far[axis] / 4;
      ends.t1[0][axis] += far[axis] / 4;
    }
  }
  return query_of(kind, ends);
}

FeatureCase huge_displacement(Random& random, ContactKind kind) {
  Ends ends = meeting(random, kind, {.eighth = any_eighth(random), .size = 1, .motion = 0});
  const int exponent = between(random, 30, 40);
  for (int k = 0; k < 4; ++k) {
    if (one_in(random, 2)) continue;
    for (int axis = 0; axis < 3; ++axis) {
      const double by = std::ldexp(integer(random, 3), exponent);
      ends.t0[k][axis] -= by;
      ends.t1[k][axis] += by;
    }
  }
  if (one_in(random, 2)) push(random, ends);
  return query_of(kind, ends);
}

FeatureCase tiny_displacement(Random& random, ContactKind kind) {
  Ends ends = meeting(random, kind, {.eighth = 0, .size = 1, .motion = 0});
  for (auto* points : {&ends.t0, &ends.t1}) {
    for (Point& p : *points) {
      for (double& x : p) x += std::ldexp(integer(random, 2), -between(random, 43, 50));
    }
  }
  return query_of(kind, ends);
}

FeatureCase denormals(Random& random, ContactKind kind) {
  Ends ends = meeting(random, kind, {.eighth = any_eighth(random), .size = 1, .motion = 8});
  if (one_in(random, 2)) ends.each([&](double& x, int, int) { x = integer(random, 4); });
  scale(ends, -1074);
  if (one_in(random, 3)) push(random, ends);
  return query_of(kind, ends);
}

// Denormal features in a scene of ordinary, or of huge, size.
FeatureCase tiny_beside_huge(Random& random, ContactKind kind) {
  Ends ends = meeting(random, kind, {.eighth = any_eighth(random)});
  const int k = below(random, 4);
  std::array<int, 4> exponent;
  for (int& e : exponent) e = between(random, -1060, -900);
  exponent[k] = between(random, -500, 900);
  const bool planar = one_in(random, 2);
  ends.each([&](double& x, int vertex, int axis) {
    x = planar && axis == 2 ? 0 : std::ldexp(x, exponent[vertex]);
  });
  return query_of(kind, ends);
}

FeatureCase chaos(Random& random, ContactKind kind) {
  Ends ends;
  ends.each([&](double& x, int, int) {
    x = one_in(random, 8) ? 0 : std::ldexp(uniform(random), between(random, -1070, 1022));
  });
  return query_of(kind, ends);
}

FeatureCase largest_doubles(Random& random, ContactKind kind) {
  Ends ends;
  constexpr double kMax = std::numeric_limits<double>::max();
  ends.each([&](double& x, int, int) {
    x = one_in(random, 4) ? 0
                          : (one_in(random, 2) ? kMax : -kMax) * (one_in(random, 2) ? 1 : uniform(random));
  });
  return query_of(kind, ends);
}

}  // namespace warmfront::testing::torture

// SPDX-License-Identifier: Apache-2.0
// Where and when they meet: on a rim, at an end of the step, touching and parting again, at one of several
// roots.
#include <array>

#include "tests/support/draws.h"
#include "tests/support/torture_families.h"

namespace warmfront::testing::torture {

FeatureCase made(Random& random, ContactKind kind) {
  return query_of(kind, meeting(random, kind, {.eighth = any_eighth(random), .where = Where::kInside}));
}

FeatureCase made_and_pushed(Random& random, ContactKind kind) {
  Ends ends = meeting(random, kind, {.eighth = any_eighth(random)});
  shear(random, ends);
  push(random, ends);
  return query_of(kind, ends);
}

// Small integers: ties of every sort.
FeatureCase lattice(Random& random, ContactKind kind) {
  Ends ends;
  const int bound = between(random, 1, 3);
  ends.each([&](double& x, int, int) { x = integer(random, bound); });
  return query_of(kind, ends);
}

FeatureCase grazing_rim(Random& random, ContactKind kind) {
  Ends ends = meeting(random, kind, {.eighth = any_eighth(random), .where = Where::kRim});
  shear(random, ends);
  return query_of(kind, ends);
}

FeatureCase grazing_rim_pushed(Random& random, ContactKind kind) {
  Ends ends = meeting(random, kind, {.eighth = any_eighth(random), .where = Where::kRim});
  shear(random, ends);
  push(random, ends);
  return query_of(kind, ends);
}

namespace {

// The last vertex's motion is such that the primitives' planes touch and part again: a double root at t =
// 1/2. Vertex 1 is the origin and vertex 2 lies on the x axis, both at rest; c is vertex 3, p vertex 0.
// Vertex 0 is in the plane of the others while p_z c_y = c_z p_y; with c_y at rest, p_z is put on the tangent
// of the quadratic right hand.
Ends touch_in_time(Random& random) {
  const double c_y = 8;
  const double p_y0 = between(random, 1, 7), p_y1 = between(random, 1, 7);
  const double c_z0 = 8 * integer(random, 8), c_z1 = 8 * integer(random, 8);
  const double middle = (p_y0 + p_y1) * (c_z0 + c_z1) / 4 / c_y;
  const double slope = ((p_y1 - p_y0) * (c_z0 + c_z1) + (c_z1 - c_z0) * (p_y0 + p_y1)) / 2 / c_y;
  Ends ends;
  const double x = between(random, 0, 8);
  ends.t0 = {
      {{x, p_y0, middle - slope / 2}, {0, 0, 0}, {between(random, 1, 16) * 1.0, 0, 0}, {0, c_y, c_z0}}};
  ends.t1 = {{{x, p_y1, middle + slope / 2}, {0, 0, 0}, ends.t0[2], {0, c_y, c_z1}}};
  return ends;
}

}  // namespace

FeatureCase touching_in_time(Random& random, ContactKind kind) {
  Ends ends = touch_in_time(random);
  shear(random, ends);
  return query_of(kind, ends);
}

FeatureCase touching_in_time_pushed(Random& random, ContactKind kind) {
  Ends ends = touch_in_time(random);
  shear(random, ends);
  if (one_in(random, 2)) scale(ends, between(random, -30, 30));
  push(random, ends);
  return query_of(kind, ends);
}

FeatureCase at_an_end(Random& random, ContactKind kind) {
  Ends ends = meeting(random, kind, {.eighth = 8 * below(random, 2)});
  shear(random, ends);
  return query_of(kind, ends);
}

FeatureCase at_an_end_pushed(Random& random, ContactKind kind) {
  Ends ends = meeting(random, kind, {.eighth = 8 * below(random, 2)});
  shear(random, ends);
  push(random, ends);
  return query_of(kind, ends);
}

namespace {

// The sign of the vertices' volume at 32 times, to count its changes; the draw is repeated until there are
// enough.
int sign_changes(const Ends& ends) {
  int changes = 0;
  double last = 0;
  for (int i = 0; i <= 32; ++i) {
    const double t = i / 32.0;
    std::array<Point, 3> e;
    for (int k = 0; k < 3; ++k) {
      for (int axis = 0; axis < 3; ++axis) {
        e[k][axis] = (1 - t) * (ends.t0[k + 1][axis] - ends.t0[0][axis]) +
                     t * (ends.t1[k + 1][axis] - ends.t1[0][axis]);
      }
    }
    const double volume = e[0][0] * (e[1][1] * e[2][2] - e[1][2] * e[2][1]) +
                          e[0][1] * (e[1][2] * e[2][0] - e[1][0] * e[2][2]) +
                          e[0][2] * (e[1][0] * e[2][1] - e[1][1] * e[2][0]);
    changes += last * volume < 0;
    if (volume != 0) last = volume;
  }
  return changes;
}

}  // namespace

FeatureCase several_roots(Random& random, ContactKind kind) {
  const int wanted = between(random, 2, 3);
  Ends ends;
  do {
    ends = meeting(random, kind, {.eighth = any_eighth(random), .size = 1, .motion = 20});
  } while (sign_changes(ends) < wanted);
  if (one_in(random, 4)) push(random, ends);
  return query_of(kind, ends);
}

}  // namespace warmfront::testing::torture

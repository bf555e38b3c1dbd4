// SPDX-License-Identifier: Apache-2.0
// Primitives and motions without a size in some direction: flat, parallel, zero, or at rest.
#include <array>
#include <cmath>

#include "tests/support/draws.h"
#include "tests/support/torture_families.h"

namespace warmfront::testing::torture {

namespace {

Ends in_plane(Random& random, ContactKind kind) {
  Ends ends = meeting(random, kind, {.eighth = any_eighth(random), .size = 3, .motion = 20});
  ends.each([&](double& x, int, int axis) {
    if (axis == 2) x = 0;
  });
  shear(random, ends);
  return ends;
}

}  // namespace

FeatureCase within_a_plane(Random& random, ContactKind kind) {
  return query_of(kind, in_plane(random, kind));
}

FeatureCase nearly_within_a_plane(Random& random, ContactKind kind) {
  Ends ends = in_plane(random, kind);
  for (int k = between(random, 1, 4); k > 0; --k) push(random, ends);
  return query_of(kind, ends);
}

FeatureCase on_a_line(Random& random, ContactKind kind) {
  Ends ends;
  const Point direction{integer(random, 3), integer(random, 3), integer(random, 3)};
  for (auto* points : {&ends.t0, &ends.t1}) {
    for (Point& p : *points) {
      const double s = integer(random, 20);
      for (int axis = 0; axis < 3; ++axis) p[axis] = s * direction[axis];
    }
  }
  if (one_in(random, 4)) push(random, ends);
  return query_of(kind, ends);
}

FeatureCase zero_length(Random& random, ContactKind kind) {
  Ends ends = meeting(random, kind, {.eighth = any_eighth(random)});
  const auto coincide = [&](int to, int from) {
    ends.t0[to] = ends.t0[from];
    ends.t1[to] = ends.t1[from];
  };
  if (kind == ContactKind::kVertexFace) {
    coincide(between(random, 1, 2), 3);
    if (one_in(random, 3)) coincide(1, 2), coincide(3, 2);
  } else {
    coincide(1, 0);
    if (one_in(random, 3)) coincide(2, 3);
  }
  // Put back to where they meet: the moving point passes the middle of what is left at t = 1/2.
  if (one_in(random, 2)) {
    for (int axis = 0; axis < 3; ++axis) {
      const double from = ends.t0[2][axis] + ends.t1[2][axis] + ends.t0[3][axis] + ends.t1[3][axis];
      ends.t0[0][axis] = from / 2 - ends.t1[0][axis];
      if (kind == ContactKind::kEdgeEdge) ends.t0[1][axis] = ends.t0[0][axis];
    }
  }
  return query_of(kind, ends);
}

// Three collinear vertices at all times, or at the moment of contact only.
FeatureCase zero_area(Random& random, ContactKind kind) {
  Ends ends = meeting(random, kind, {.eighth = 4});
  for (int axis = 0; axis < 3; ++axis) {
    const double w = 2;
    ends.t0[3][axis] = ends.t0[1][axis] + w * (ends.t0[2][axis] - ends.t0[1][axis]);
    ends.t1[3][axis] = ends.t1[1][axis] + w * (ends.t1[2][axis] - ends.t1[1][axis]);
    if (kind == ContactKind::kVertexFace) {  // meets the segment at 1/4, or passes it by
      const double middle0 = (3 * ends.t0[1][axis] + ends.t0[2][axis]) / 4;
      const double middle1 = (3 * ends.t1[1][axis] + ends.t1[2][axis]) / 4;
      const double off = 8 * integer(random, 50);
      ends.t0[0][axis] = middle0 + off;
      ends.t1[0][axis] = middle1 - off;
    }
  }
  if (one_in(random, 3)) push(random, ends);
  return query_of(kind, ends);
}

FeatureCase duplicate_vertices(Random& random, ContactKind kind) {
  Ends ends = meeting(random, kind, {.eighth = any_eighth(random)});
  auto& points = one_in(random, 2) ? ends.t0 : ends.t1;
  for (int k = between(random, 1, 2); k > 0; --k) points[below(random, 4)] = points[below(random, 4)];
  return query_of(kind, ends);
}

// Edges parallel (VF: one of the face's to the vertex's path) at all times, at both ends, or at one time.
FeatureCase parallel_edges(Random& random, ContactKind kind) {
  Ends ends = meeting(random, kind, {.eighth = any_eighth(random), .size = 2, .motion = 10});
  const double s0 = integer(random, 3), s1 = one_in(random, 2) ? s0 : integer(random, 3);
  for (int axis = 0; axis < 3; ++axis) {
    ends.t0[3][axis] = ends.t0[2][axis] + s0 * (ends.t0[1][axis] - ends.t0[0][axis]);
    ends.t1[3][axis] = ends.t1[2][axis] + s1 * (ends.t1[1][axis] - ends.t1[0][axis]);
  }
  if (one_in(random, 2)) {  // brought into one line at t = 1/2
    for (int axis = 0; axis < 3; ++axis) {
      const double gap = (ends.t0[2][axis] + ends.t1[2][axis] - ends.t0[0][axis] - ends.t1[0][axis]) / 2;
      for (int k : {2, 3}) {
        ends.t0[k][axis] -= gap;
        ends.t1[k][axis] -= gap;
      }
    }
  }
  if (one_in(random, 3)) push(random, ends);
  return query_of(kind, ends);
}

FeatureCase no_motion(Random& random, ContactKind kind) {
  Ends ends = meeting(random, kind, {.eighth = 0});
  shear(random, ends);
  if (one_in(random, 2)) push(random, ends), ends.t0 = one_in(random, 2) ? ends.t0 : ends.t1;
  ends.t1 = ends.t0;
  return query_of(kind, ends);
}

// Everything moves alike, far or hardly, in contact all the time or always a unit apart.
FeatureCase common_motion(Random& random, ContactKind kind) {
  Ends ends = meeting(random, kind, {.eighth = 0, .size = 1, .motion = 0});
  if (one_in(random, 2)) {
    const int axis = below(random, 3);
    ends.t0[0][axis] += 1;
    ends.t1[0][axis] += 1;
  }
  const int exponent = one_in(random, 2) ? between(random, 0, 40) : between(random, -40, 0);
  Point by;
  for (double& x : by) x = std::ldexp(integer(random, 3), exponent);
  for (Point& p : ends.t1) {
    for (int axis = 0; axis < 3; ++axis) p[axis] += by[axis];
  }
  if (one_in(random, 2)) push(random, ends);
  return query_of(kind, ends);
}

}  // namespace warmfront::testing::torture

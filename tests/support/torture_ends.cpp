// SPDX-License-Identifier: Apache-2.0
#include "tests/support/torture_ends.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "tests/support/draws.h"

namespace warmfront::testing::torture {

FeatureCase query_of(ContactKind kind, const Ends& ends) {
  return {kind, ends.t0, ends.t1};
}

double integer(Random& random, int bound) {
  return between(random, -bound, bound);
}
double uniform(Random& random) {
  return static_cast<double>(random() >> 11) * 0x1p-52 - 1;
}

Ends meeting(Random& random, ContactKind kind, const Meeting& m) {
  std::array<Point, 4> at;
  for (Point& p : at) {
    for (double& x : p) x = 64 * integer(random, m.size);
  }
  const auto weight = [&] {
    if (m.where == Where::kInside) return between(random, 1, 6);
    return m.where == Where::kRim ? 8 * below(random, 2) : below(random, 9);
  };
  if (kind == ContactKind::kVertexFace) {
    int u = weight();
    int v = m.where == Where::kInside ? between(random, 1, 7 - u) : below(random, 9 - u);
    if (m.where == Where::kRim) {
      if (one_in(random, 2)) v = 0;
      if (one_in(random, 2)) u = 8 - v;
    }
    for (int axis = 0; axis < 3; ++axis) {
      at[0][axis] = (u * at[1][axis] + v * at[2][axis] + (8 - u - v) * at[3][axis]) / 8;
    }
  } else {
    // The point of edge (2, 3) at u / 8 lies at 1/2 or at the end 0 of edge (0, 1).
    const int u = weight();
    const bool at_end = m.where == Where::kRim || (m.where == Where::kAnywhere && one_in(random, 3));
    for (int axis = 0; axis < 3; ++axis) {
      const double p = (u * at[2][axis] + (8 - u) * at[3][axis]) / 8;
      at[0][axis] = at_end ? p : 2 * p - at[1][axis];
    }
  }
  Ends ends{at, at};
  for (int k = 0; k < 4; ++k) {
    for (int axis = 0; axis < 3; ++axis) {
      const double velocity = 8 * integer(random, m.motion);
      ends.t0[k][axis] -= velocity * m.eighth / 8;
      ends.t1[k][axis] += velocity * (8 - m.eighth) / 8;
    }
  }
  return ends;
}

void shear(Random& random, Ends& ends) {
  const double a = integer(random, 3), b = integer(random, 3), c = integer(random, 3);
  const auto apply = [&](Point& p) {
    p[1] += a * p[0];
    p[2] += b * p[1] + c * p[0];
    p[0] += c * p[2];
  };
  std::ranges::for_each(ends.t0, apply);
  std::ranges::for_each(ends.t1, apply);
}

void scale(Ends& ends, int exponent) {
  ends.each([&](double& x, int, int) { x = std::ldexp(x, exponent); });
}

void push(Random& random, Ends& ends) {
  double& x = (one_in(random, 2) ? ends.t0 : ends.t1)[below(random, 4)][below(random, 3)];
  const double far = std::numeric_limits<double>::max();
  x = std::nextafter(x, one_in(random, 2) ? far : -far);
}

int any_eighth(Random& random) {
  return between(random, 0, 8);
}

}  // namespace warmfront::testing::torture

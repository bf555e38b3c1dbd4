// SPDX-License-Identifier: Apache-2.0
#include "tests/support/torture.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <limits>
#include <string>

#include "tests/support/draws.h"

namespace warmfront::testing {
namespace {

using Random = std::mt19937_64;
using Point = std::array<double, 3>;
using Made = FeatureCase (*)(Random&, ContactKind);

// Where the vertices are at both ends of the step.
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

FeatureCase query_of(ContactKind kind, const Ends& ends) {
  return {kind, ends.t0, ends.t1};
}

double integer(Random& random, int bound) {
  return between(random, -bound, bound);
}
double uniform(Random& random) {
  return static_cast<double>(random() >> 11) * 0x1p-52 - 1;
}

// Where on the primitives they meet: inside both, or on their rims.
enum class Where { kAnywhere, kInside, kRim };

// Integers below 2^20 in size such that the primitives meet at time `eighth` / 8, exactly, whatever they do
// before.
struct Meeting {
  int eighth = 4;
  Where where = Where::kAnywhere;
  int size = 100;    // half the largest coordinate, in units of 64
  int motion = 100;  // half the largest displacement, in units of 8
};

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

// The same seen along other axes: three elementary shears, exact on the integers here.
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

// One coordinate to the next double, either way.
void push(Random& random, Ends& ends) {
  double& x = (one_in(random, 2) ? ends.t0 : ends.t1)[below(random, 4)][below(random, 3)];
  const double far = std::numeric_limits<double>::max();
  x = std::nextafter(x, one_in(random, 2) ? far : -far);
}

int any_eighth(Random& random) {
  return between(random, 0, 8);
}

FeatureCase general(Random& random, ContactKind kind) {
  Ends ends;
  ends.each([&](double& x, int, int) { x = uniform(random); });
  return query_of(kind, ends);
}

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

Ends in_plane(Random& random, ContactKind kind) {
  Ends ends = meeting(random, kind, {.eighth = any_eighth(random), .size = 3, .motion = 20});
  ends.each([&](double& x, int, int axis) {
    if (axis == 2) x = 0;
  });
  shear(random, ends);
  return ends;
}

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

FeatureCase several_roots(Random& random, ContactKind kind) {
  const int wanted = between(random, 2, 3);
  Ends ends;
  do {
    ends = meeting(random, kind, {.eighth = any_eighth(random), .size = 1, .motion = 20});
  } while (sign_changes(ends) < wanted);
  if (one_in(random, 4)) push(random, ends);
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

// Another family's query at another place and scale, with another rounding or two.
FeatureCase composed(Random& random, ContactKind kind) {
  constexpr Made kBase[] = {
      made_and_pushed, lattice,        grazing_rim, touching_in_time, at_an_end,
      within_a_plane,  on_a_line,      zero_area,   needle,           duplicate_vertices,
      several_roots,   parallel_edges, no_motion,   tiny_displacement};
  const FeatureCase base = kBase[below(random, std::ssize(kBase))](random, kind);
  Ends ends;
  for (int k = 0; k < 4; ++k) {
    for (int axis = 0; axis < 3; ++axis) {
      ends.t0[k][axis] = base.vertices[k].t0[axis];
      ends.t1[k][axis] = base.vertices[k].t1[axis];
    }
  }
  if (one_in(random, 2)) scale(ends, between(random, -60, 60));
  if (one_in(random, 2)) {
    Point offset;
    for (double& x : offset) x = std::ldexp(uniform(random), between(random, -10, 50));
    ends.each([&](double& x, int, int axis) { x += offset[axis]; });
  }
  if (one_in(random, 3)) ends.each([](double& x, int, int) { x = static_cast<float>(x); });
  if (one_in(random, 3)) push(random, ends);
  if (one_in(random, 3)) scale(ends, between(random, -900, 900));
  return query_of(kind, ends);
}

constexpr TortureFamily kFamilies[] = {
    {"general", general},
    {"made", made},
    {"made, pushed", made_and_pushed},
    {"lattice", lattice},
    {"large offset", large_offset},
    {"extreme scale", extreme_scale},
    {"uneven axes", uneven_axes},
    {"needle", needle},
    {"grazing rim", grazing_rim},
    {"grazing rim, pushed", grazing_rim_pushed},
    {"touching in time", touching_in_time},
    {"touching in time, pushed", touching_in_time_pushed},
    {"at an end", at_an_end},
    {"at an end, pushed", at_an_end_pushed},
    {"within a plane", within_a_plane},
    {"nearly within a plane", nearly_within_a_plane},
    {"on a line", on_a_line},
    {"zero length", zero_length},
    {"zero area", zero_area},
    {"duplicate vertices", duplicate_vertices},
    {"no motion", no_motion},
    {"common motion", common_motion},
    {"huge displacement", huge_displacement},
    {"tiny displacement", tiny_displacement},
    {"several roots", several_roots},
    {"parallel edges", parallel_edges},
    {"denormals", denormals},
    {"tiny beside huge", tiny_beside_huge},
    {"chaos", chaos},
    {"largest doubles", largest_doubles},
    {"composed", composed},
};

}  // namespace

std::span<const TortureFamily> torture_families() {
  return kFamilies;
}

std::string to_text(const FeatureCase& query) {
  std::string text = query.kind == ContactKind::kVertexFace ? "vf" : "ee";
  for (const auto end : {&VertexMotion::t0, &VertexMotion::t1}) {
    text += " {{";
    for (int k = 0; k < 4; ++k) {
      const auto& p = query.vertices[k].*end;
      char point[96];
      std::snprintf(point, sizeof point, "%s{%a, %a, %a}", k == 0 ? "" : ", ", p[0], p[1], p[2]);
      text += point;
    }
    text += "}}";
  }
  return text;
}

}  // namespace warmfront::testing

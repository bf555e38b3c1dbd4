// SPDX-License-Identifier: Apache-2.0
#include "tests/support/near_torture.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>

#include "tests/support/distance.h"
#include "tests/support/draws.h"
#include "tests/support/torture.h"

namespace warmfront::testing {
namespace {

using Random = std::mt19937_64;
using Point = std::array<double, 3>;

Point operator+(const Point& a, const Point& b) {
  return {a[0] + b[0], a[1] + b[1], a[2] + b[2]};
}
Point operator*(double s, const Point& a) {
  return {s * a[0], s * a[1], s * a[2]};
}
Point cross(const Point& a, const Point& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

// A vector of integers with an integer length, and two of integers that are perpendicular to it and each
// other.
struct Frame {
  Point apart;
  double length;
  Point along;
  Point across;

  explicit Frame(Random& random) {
    struct Known {
      Point vector;
      double length;
    };
    constexpr std::array<Known, 7> kKnown{{{{0, 0, 1}, 1},
                                           {{0, 3, 4}, 5},
                                           {{1, 2, 2}, 3},
                                           {{2, 3, 6}, 7},
                                           {{1, 4, 8}, 9},
                                           {{4, 4, 7}, 9},
                                           {{0, 5, 12}, 13}}};
    const Known& known = kKnown[below(random, 7)];
    apart = known.vector;
    length = known.length;
    std::ranges::shuffle(apart, random);
    for (double& x : apart) x *= one_in(random, 2) ? 1 : -1;
    do {
      along = cross(
          apart, {between(random, -2, 2) * 1.0, between(random, -2, 2) * 1.0, between(random, -2, 2) * 1.0});
    } while (along == Point{0, 0, 0});
    across = cross(apart, along);
  }
};

// The primitives at one eighth of the step, and how vertex 0 (or the edge 0, 1) moves relative to the other.
struct Moment {
  std::array<Point, 4> at;
  Point velocity;  // per eighth of the step
};

// All vertices in motion with the instant at `eighth`; of the pairs made, some are pushed off by an ulp, some
// scaled.
NearCase moved(Random& random, ContactKind kind, const Moment& instant, double separation) {
  const int eighth = between(random, 0, 8);
  const Point common{between(random, -3, 3) * 1.0, between(random, -3, 3) * 1.0,
                     between(random, -3, 3) * 1.0};
  Points t0;
  Points t1;
  for (int k = 0; k < 4; ++k) {
    const bool first = k == 0 || (k == 1 && kind == ContactKind::kEdgeEdge);
    const Point velocity = first ? common + instant.velocity : common;
    t0[k] = instant.at[k] + -eighth * velocity;
    t1[k] = instant.at[k] + (8 - eighth) * velocity;
  }
  const int exponent = one_in(random, 3) ? between(random, -1000, 900) : 0;
  for (auto* points : {&t0, &t1}) {
    for (Point& p : *points) {
      for (double& x : p) x = std::ldexp(x, exponent);
    }
  }
  separation = std::ldexp(separation, exponent);
  switch (below(random, 4)) {
    case 0:
      separation = std::nextafter(separation, one_in(random, 2) ? 0 : std::numeric_limits<double>::max());
      break;
    case 1: {
      double& x = (one_in(random, 2) ? t0 : t1)[below(random, 4)][below(random, 3)];
      x = std::nextafter(x, one_in(random, 2) ? 1e300 : -1e300);
      break;
    }
    default:
      break;
  }
  return {FeatureCase(kind, t0, t1), separation};
}

// Past the other primitive at its distance, toward it or away from it; or at rest.
Point velocity(Random& random, const Frame& frame) {
  const auto share = [&] { return static_cast<double>(between(random, -2, 2)); };
  Point v{0, 0, 0};
  const int way = below(random, 5);
  if (way != 0) v = v + share() * frame.along + share() * frame.across;
  if (way == 1) v = v + share() * frame.apart;
  return v;
}

Point behind(Random& random, const Frame& frame) {
  return -between(random, 0, 3) * frame.apart + between(random, -3, 3) * frame.along +
         between(random, -3, 3) * frame.across;
}

Point somewhere(Random& random) {
  return {between(random, -9, 9) * 1.0, between(random, -9, 9) * 1.0, between(random, -9, 9) * 1.0};
}

NearCase vertex_vertex(Random& random, ContactKind kind) {
  const Frame frame(random);
  const Point at = somewhere(random);
  Moment made{{at + frame.apart, at, at + behind(random, frame), at + behind(random, frame)},
              velocity(random, frame)};
  if (kind == ContactKind::kEdgeEdge) {
    made.at = {at + frame.apart, at + frame.apart + -1 * behind(random, frame), at,
               at + behind(random, frame)};
    if (one_in(random, 2)) std::swap(made.at[2], made.at[3]);
  }
  return moved(random, kind, made, frame.length);
}

// The foot is inside the edge, at one of its ends, or beyond.
NearCase vertex_edge(Random& random, ContactKind kind) {
  const Frame frame(random);
  const Point at = somewhere(random);
  const Point a = at + between(random, -3, 1) * frame.along;
  const Point b = at + between(random, 0, 3) * frame.along;
  Moment made{{at + frame.apart, a, b, at + behind(random, frame)}, velocity(random, frame)};
  if (kind == ContactKind::kEdgeEdge)
    made.at = {at + frame.apart, at + frame.apart + -1 * behind(random, frame), a, b};
  return moved(random, kind, made, frame.length);
}

// Above a face that holds the foot, has it on its rim, or does not; or between two crossing edges.
NearCase interiors(Random& random, ContactKind kind) {
  const Frame frame(random);
  const Point at = somewhere(random);
  const auto in_plane = [&](int s, int r) { return at + s * frame.along + r * frame.across; };
  Moment made{{at + frame.apart, in_plane(-between(random, 0, 2), -between(random, 0, 2)),
               in_plane(between(random, 0, 3), between(random, -1, 1)),
               in_plane(between(random, -1, 1), between(random, 0, 3))},
              velocity(random, frame)};
  if (kind == ContactKind::kEdgeEdge) {
    made.at = {at + frame.apart + -between(random, 0, 2) * frame.along,
               at + frame.apart + between(random, 0, 2) * frame.along, in_plane(0, -between(random, 0, 2)),
               in_plane(between(random, 0, 1), between(random, 0, 2))};
  }
  return moved(random, kind, made, frame.length);
}

// Edges along one line's direction, or a vertex over a face without area: for part of the step, or all of it,
// exactly the separation apart.
NearCase parallel(Random& random, ContactKind kind) {
  const Frame frame(random);
  const Point at = somewhere(random);
  const auto on_line = [&](int lo, int hi) { return at + between(random, lo, hi) * frame.along; };
  Moment made{{at + frame.apart, on_line(-3, 3), on_line(-3, 3), on_line(-3, 3)}, velocity(random, frame)};
  if (kind == ContactKind::kEdgeEdge) made.at[1] = frame.apart + made.at[1];
  if (one_in(random, 2)) made.velocity = between(random, -2, 2) * frame.along;
  return moved(random, kind, made, frame.length);
}

// Every vertex moves by itself; the separation is an integer.
NearCase lattice(Random& random, ContactKind kind) {
  Points t0;
  Points t1;
  const int bound = between(random, 1, 4);
  for (auto* points : {&t0, &t1}) {
    for (Point& p : *points) {
      for (double& x : p) x = between(random, -bound, bound);
    }
  }
  return {FeatureCase(kind, t0, t1), static_cast<double>(between(random, 1, 3)) / between(random, 1, 2)};
}

// Nearer than the separation only at the very end, or, turned round, at the start.
NearCase at_an_end(Random& random, ContactKind kind) {
  const Frame frame(random);
  const Point at = somewhere(random);
  Points near{at + frame.apart, at, at + behind(random, frame), at + behind(random, frame)};
  if (kind == ContactKind::kEdgeEdge) near[1] = at + frame.apart + -1 * behind(random, frame);
  if (kind == ContactKind::kEdgeEdge) near[2] = at;
  Points far = near;
  for (int k = 0; k < (kind == ContactKind::kEdgeEdge ? 2 : 1); ++k) {
    far[k] = far[k] + between(random, 1, 3) * frame.apart + between(random, -3, 3) * frame.along;
  }
  double separation = frame.length;
  if (one_in(random, 3)) separation = std::nextafter(separation, one_in(random, 2) ? 0 : 1e300);
  if (one_in(random, 3)) return {FeatureCase(kind, near, far), separation};
  return {FeatureCase(kind, far, near), separation};
}

constexpr NearFamily kFamilies[] = {
    {"vertex_vertex", vertex_vertex}, {"vertex_edge", vertex_edge}, {"interiors", interiors},
    {"parallel", parallel},           {"lattice", lattice},         {"at_an_end", at_an_end},
};

}  // namespace

std::span<const NearFamily> near_families() {
  return kFamilies;
}

double any_separation(std::mt19937_64& random, const FeatureCase& query) {
  double size = 0;
  for (const VertexMotion& v : query.vertices) {
    for (int axis = 0; axis < 3; ++axis) {
      const double from0 = v.t0[axis] / 2 - query.vertices[0].t0[axis] / 2;
      const double from1 = v.t1[axis] / 2 - query.vertices[0].t1[axis] / 2;
      size = std::max({size, std::fabs(from0), std::fabs(from1)});
    }
  }
  const double least = std::numeric_limits<double>::denorm_min();
  const auto distance = [&] {
    const double t = static_cast<double>(below(random, 9)) / 8;
    return static_cast<double>(relative_distance(query.features(), t) * (2 * static_cast<long double>(size)));
  };
  double separation = 0;
  switch (below(random, 8)) {
    case 0:
      separation = least;
      break;
    case 1:
      separation = size;
      break;
    case 2:
      separation = std::ldexp(size, -between(random, 1, 60));
      break;
    case 3:
      separation =
          one_in(random, 4) ? std::numeric_limits<double>::max() : std::ldexp(size, between(random, 0, 2));
      break;
    case 4:
      separation = std::nextafter(distance(), one_in(random, 2) ? 0 : 1e300);
      break;
    case 5:
      separation = distance() * (0.5 + static_cast<double>(below(random, 100)) / 100);
      break;
    default:
      separation = distance();
      break;
  }
  return std::isfinite(separation) ? std::max(separation, least) : 1;
}

std::string to_text(const NearCase& made) {
  std::array<char, 64> digits{};
  std::snprintf(digits.data(), digits.size(), ", separation %a", made.separation);
  return to_text(made.query) + digits.data();
}

}  // namespace warmfront::testing

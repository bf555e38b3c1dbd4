// SPDX-License-Identifier: Apache-2.0
#include "engine/elementary/fast.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "engine/elementary/cubic.h"

namespace warmfront {
namespace {

// A cubic as k0 + t (c1 + t (c2 + t c3)).
struct Powers {
  double c0;
  double c1;
  double c2;
  double c3;

  explicit Powers(const std::array<double, 4>& k)
      : c0(k[0]),
        c1(3 * (k[1] - k[0])),
        c2(3 * (k[2] - 2 * k[1] + k[0])),
        c3(k[3] - 3 * (k[2] - k[1]) - k[0]) {}
  double at(double t) const { return c0 + t * (c1 + t * (c2 + t * c3)); }
  double slope(double t) const { return c1 + t * (2 * c2 + t * (3 * c3)); }
};

// The root of f in [begin, end], at whose ends f has different signs (or is zero): Newton's steps where they
// stay within the bracket, halving where they do not.
double root_between(const Powers& f, double begin, double end, double at_begin) {
  double t = 0.5 * (begin + end);
  for (int i = 0; i < 60; ++i) {
    const double value = f.at(t);
    if (value == 0) return t;
    ((value > 0) == (at_begin > 0) ? begin : end) = t;
    double next = t - value / f.slope(t);
    if (!(next > begin && next < end)) next = 0.5 * (begin + end);
    if (std::fabs(next - t) <= 0x1p-52) return next;
    t = next;
  }
  return t;
}

// The times at which f turns, ascending within (0, 1), with 0 before and 1 after them.
struct Turns {
  std::array<double, 4> time{0, 1};
  int count = 2;

  explicit Turns(const Powers& f) {
    const double half = f.c2;
    const double discriminant = half * half - 3 * f.c3 * f.c1;
    if (!(discriminant > 0)) return;
    const double q = -(half + std::copysign(std::sqrt(discriminant), half));
    double first = q / (3 * f.c3);
    double second = f.c1 / q;
    if (first > second) std::swap(first, second);
    count = 1;
    if (first > 0 && first < 1) time[count++] = first;
    if (second > 0 && second < 1) time[count++] = second;
    time[count++] = 1;
  }
};

bool inside_at(const Query& query, double t) {
  const Vec3 a = query.from0[0].at(t);
  const Vec3 b = query.from0[1].at(t);
  const Vec3 c = query.from0[2].at(t);
  if (query.kind == ContactKind::kVertexFace) {
    const Vec3 n = cross(b - a, c - a);
    return dot(cross(b, c), n) >= 0 && dot(cross(c, a), n) >= 0 && dot(cross(a, b), n) >= 0;
  }
  const Vec3 h = c - b;
  const Vec3 n = cross(a, h);
  const double nn = dot(n, n);
  const double along_e = dot(cross(b, h), n);
  const double along_h = dot(cross(b, a), n);
  return along_e >= 0 && along_e <= nn && along_h >= 0 && along_h <= nn;
}

}  // namespace

Verdict fast_test(const FeatureVertices& features, double latest) {
  const Query query = Query::prepare(features, 0);
  if (query.size == 0) return Verdict::at(0, ContactStatus::kHit);
  Window window;
  if (!trim_by_kdop(query, window)) return {};
  const Powers f(Cubic(query).coefficient);
  const Turns turns(f);
  double before = f.c0;
  for (int i = 1; i < turns.count; ++i) {
    const double after = f.at(turns.time[i]);
    if ((before <= 0 && after >= 0) || (before >= 0 && after <= 0)) {
      const double root = root_between(f, turns.time[i - 1], turns.time[i], before);
      if (root > latest) return {};
      if (inside_at(query, root)) return Verdict::at(root, ContactStatus::kHit);
    }
    before = after;
  }
  return {};
}

}  // namespace warmfront

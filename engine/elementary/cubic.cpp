// SPDX-License-Identifier: Apache-2.0
#include "engine/elementary/cubic.h"

#include <algorithm>
#include <cmath>

namespace warmfront {
namespace {

// An upper bound of |n(t)| over the step for the normal n = p x q of two moving vectors: a quadratic Bezier,
// bounded by its controls p0 x q0, (p0 x q1 + p1 x q0) / 2, p1 x q1. Ten roundings and a scale of 2 are well
// below 2^-40.
double normal_bound(const MovingVec3& p, const MovingVec3& q) {
  const Vec3 n0 = cross(p.t0, q.t0);
  const Vec3 n1 = cross(p.t1, q.t1);
  const Vec3 m = 0.5 * (cross(p.t0, q.t1) + cross(p.t1, q.t0));
  return std::max({norm(n0), norm(m), norm(n1)}) * (1 + 0x1p-48) + 0x1p-45;
}

}  // namespace

Cubic::Cubic(const Query& query) {
  const auto& [e, g, q] = query.from0;
  const Vec3 c00 = cross(g.t0, q.t0);
  const Vec3 c11 = cross(g.t1, q.t1);
  const Vec3 c01 = cross(g.t0, q.t1) + cross(g.t1, q.t0);
  coefficient[0] = dot(e.t0, c00);
  coefficient[1] = (dot(e.t1, c00) + dot(e.t0, c01)) / 3;
  coefficient[2] = (dot(e.t0, c11) + dot(e.t1, c01)) / 3;
  coefficient[3] = dot(e.t1, c11);
  const auto largest = [](const MovingVec3& v) { return std::max(max_abs(v.t0), max_abs(v.t1)); };
  error = 112 * kUnit * largest(e) * largest(g) * largest(q) + 0x1p-1000;
  magnitude = std::max({std::fabs(coefficient[0]), std::fabs(coefficient[1]), std::fabs(coefficient[2]),
                        std::fabs(coefficient[3])});
  slack = 0;
  if (query.separation > 0) {
    const auto minus = [](const MovingVec3& a, const MovingVec3& b) {
      return MovingVec3{a.t0 - b.t0, a.t1 - b.t1};
    };
    const double normal = query.kind == ContactKind::kVertexFace ? normal_bound(minus(g, e), minus(q, e))
                                                                 : normal_bound(e, minus(q, g));
    slack = query.separation * normal * (1 + 0x1p-45);
  }
}

double Cubic::at(double t) const {
  const double a = lerp(lerp(coefficient[0], coefficient[1], t), lerp(coefficient[1], coefficient[2], t), t);
  const double b = lerp(lerp(coefficient[1], coefficient[2], t), lerp(coefficient[2], coefficient[3], t), t);
  return lerp(a, b, t);
}

std::array<double, 4> Cubic::on(const Window& window) const {
  const auto& k = coefficient;
  const double l = window.begin;
  const double r = window.end;
  // First level at l and at r, second level at (l,l), (l,r), (r,r), third level: the blossom at lll, llr,
  // lrr, rrr.
  const std::array<double, 3> kl{lerp(k[0], k[1], l), lerp(k[1], k[2], l), lerp(k[2], k[3], l)};
  const std::array<double, 3> kr{lerp(k[0], k[1], r), lerp(k[1], k[2], r), lerp(k[2], k[3], r)};
  const std::array<double, 2> ll{lerp(kl[0], kl[1], l), lerp(kl[1], kl[2], l)};
  const std::array<double, 2> lr{lerp(kl[0], kl[1], r), lerp(kl[1], kl[2], r)};
  const std::array<double, 2> rr{lerp(kr[0], kr[1], r), lerp(kr[1], kr[2], r)};
  return {lerp(ll[0], ll[1], l), lerp(ll[0], ll[1], r), lerp(lr[0], lr[1], r), lerp(rr[0], rr[1], r)};
}

bool Cubic::clip(Window& window) const {
  const std::array<double, 4> k = on(window);
  const double widening = certain() + slack;
  // The hull of the points (i, k[i] +- widening) meets zero at points whose own band contains zero, and
  // between the crossings of segments from a point not below zero to one not above. The lower points among
  // themselves and the upper ones among themselves give the extremes: raising either end moves a crossing
  // away from the positive end.
  double first = 4;
  double last = -1;
  const auto reach = [&](double crossing) {
    first = std::min(first, crossing);
    last = std::max(last, crossing);
  };
  for (int i = 0; i < 4; ++i) {
    if (k[i] - widening <= 0 && k[i] + widening >= 0) reach(i);
    for (int j = 0; j < 4; ++j) {
      for (const double shift : {-widening, widening}) {
        const double above = k[i] + shift;
        const double below = k[j] + shift;
        if (above >= 0 && below < 0) reach(i + (j - i) * (above / (above - below)));
      }
    }
  }
  if (last < first) return false;
  const double width = window.width();
  const double begin = window.begin + (first / 3) * width - 0x1p-49;
  const double end = window.begin + (last / 3) * width + 0x1p-49;
  window = {std::max(window.begin, begin), std::min(window.end, end)};
  return true;
}

bool Cubic::certain_sign_change(const Window& window) const {
  const double begin = at(window.begin);
  const double end = at(window.end);
  return (begin > certain() && end < -certain()) || (begin < -certain() && end > certain());
}

}  // namespace warmfront

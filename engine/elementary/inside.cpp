// SPDX-License-Identifier: Apache-2.0
#include "engine/elementary/inside.h"

#include <algorithm>
#include <array>

namespace warmfront {
namespace {

using Quartic = std::array<double, 5>;

// A vector that is a quadratic Bezier over the window.
struct Quadratic {
  Vec3 c0;
  Vec3 cm;
  Vec3 c1;
};

Quadratic cross(const MovingVec3& p, const MovingVec3& q) {
  return {cross(p.t0, q.t0), 0.5 * (cross(p.t0, q.t1) + cross(p.t1, q.t0)), cross(p.t1, q.t1)};
}

Quartic dot(const Quadratic& m, const Quadratic& n) {
  return {dot(m.c0, n.c0), 0.5 * (dot(m.cm, n.c0) + dot(m.c0, n.cm)),
          (dot(m.c0, n.c1) + 4 * dot(m.cm, n.cm) + dot(m.c1, n.c0)) / 6,
          0.5 * (dot(m.cm, n.c1) + dot(m.c1, n.cm)), dot(m.c1, n.c1)};
}

Quartic operator-(const Quartic& a, const Quartic& b) {
  Quartic difference;
  for (int i = 0; i < 5; ++i) difference[i] = a[i] - b[i];
  return difference;
}

MovingVec3 operator-(const MovingVec3& a, const MovingVec3& b) {
  return {a.t0 - b.t0, a.t1 - b.t1};
}

double largest(const MovingVec3& v) {
  return std::max(max_abs(v.t0), max_abs(v.t1));
}

// Combines one condition "quartic >= 0" with the answer so far.
Inside require(Inside so_far, const Quartic& quartic, double error) {
  if (so_far == Inside::kNo) return so_far;
  const auto [lo, hi] = std::minmax_element(quartic.begin(), quartic.end());
  if (*hi < -error) return Inside::kNo;
  return *lo > error ? so_far : Inside::kUnknown;
}

}  // namespace

Inside inside(const Query& query, const Window& window) {
  std::array<MovingVec3, 3> p;
  for (int k = 0; k < 3; ++k) p[k] = {query.from0[k].at(window.begin), query.from0[k].at(window.end)};
  Inside verdict = Inside::kYes;
  if (query.kind == ContactKind::kVertexFace) {
    const auto& [a, b, c] = p;
    const double size = std::max({largest(a), largest(b), largest(c)});
    const double error = 2048 * kUnit * size * size * size + 0x1p-1000;
    const Quadratic n = cross(b - a, c - a);
    verdict = require(verdict, dot(cross(b, c), n), error);
    verdict = require(verdict, dot(cross(c, a), n), error);
    verdict = require(verdict, dot(cross(a, b), n), error);
  } else {
    const auto& [e, g, q] = p;
    const MovingVec3 h = q - g;
    const double size = std::max({largest(e), largest(g), largest(h)});
    const double error = 2048 * kUnit * size * size * size + 0x1p-1000;
    const Quadratic n = cross(e, h);
    const Quartic nn = dot(n, n);
    const Quartic along_e = dot(cross(g, h), n);
    const Quartic along_h = dot(cross(g, e), n);
    verdict = require(verdict, along_e, error);
    verdict = require(verdict, along_h, error);
    verdict = require(verdict, nn - along_e, error);
    verdict = require(verdict, nn - along_h, error);
  }
  return verdict;
}

Inside inside_around(const Query& query, double t, double reach) {
  const Vec3 a = query.from0[0].at(t);
  const Vec3 b = query.from0[1].at(t);
  const Vec3 c = query.from0[2].at(t);
  const double moved = query.relative_motion * reach;
  const auto among = [&](double size, double lowest) {
    if (!(moved <= 0x1p-8 * size)) return Inside::kUnknown;
    const double error = (2048 * kUnit + 256 * moved) * (size * size * size) + 0x1p-1000;
    if (lowest < -error) return Inside::kNo;
    return lowest > error ? Inside::kYes : Inside::kUnknown;
  };
  if (query.kind == ContactKind::kVertexFace) {
    const Vec3 n = cross(b - a, c - a);
    return among(std::max({max_abs(a), max_abs(b), max_abs(c)}),
                 std::min({dot(cross(b, c), n), dot(cross(c, a), n), dot(cross(a, b), n)}));
  }
  const Vec3 h = c - b;
  const Vec3 n = cross(a, h);
  const double nn = dot(n, n);
  const double along_e = dot(cross(b, h), n);
  const double along_h = dot(cross(b, a), n);
  return among(std::max({max_abs(a), max_abs(b), max_abs(h)}),
               std::min(std::min(along_e, along_h), nn - std::max(along_e, along_h)));
}

}  // namespace warmfront

// SPDX-License-Identifier: Apache-2.0
#include "engine/elementary/query.h"

#include "engine/elementary/closest.h"

namespace warmfront {
namespace {

Vec3 difference(const std::array<double, 4>& to, const std::array<double, 4>& from, double prescale) {
  return {to[0] * prescale - from[0] * prescale, to[1] * prescale - from[1] * prescale,
          to[2] * prescale - from[2] * prescale};
}

MovingVec3 difference(const VertexMotion& to, const VertexMotion& from, double prescale) {
  return {difference(to.t0, from.t0, prescale), difference(to.t1, from.t1, prescale)};
}

// All differences, of coordinates times `prescale`.
Query differences(const FeatureVertices& features, double prescale) {
  const auto& v = features.vertex;
  Query query{};
  query.kind = features.kind;
  for (int k = 0; k < 3; ++k) query.from0[k] = difference(*v[k + 1], *v[0], prescale);
  if (features.kind == ContactKind::kVertexFace) {
    query.gap_count = 3;
    for (int k = 0; k < 3; ++k) query.gaps[k] = query.from0[k];
  } else {
    query.gap_count = 4;
    query.gaps[0] = query.from0[1];
    query.gaps[1] = query.from0[2];
    query.gaps[2] = difference(*v[2], *v[1], prescale);
    query.gaps[3] = difference(*v[3], *v[1], prescale);
  }
  query.size = 0;
  for (int k = 0; k < query.gap_count; ++k) {
    query.size = std::max({query.size, max_abs(query.gaps[k].t0), max_abs(query.gaps[k].t1)});
  }
  return query;
}

// A power of two as two factors, each within double's range.
struct PowerOfTwo {
  double a;
  double b;
  explicit PowerOfTwo(int exponent)
      : a(std::ldexp(1.0, exponent / 2)), b(std::ldexp(1.0, exponent - exponent / 2)) {}
  double operator()(double x) const { return x * a * b; }
  Vec3 operator()(const Vec3& v) const { return {(*this)(v.x), (*this)(v.y), (*this)(v.z)}; }
};

}  // namespace

Query Query::prepare(const FeatureVertices& features, double min_separation) {
  double prescale = 1;
  Query query = differences(features, prescale);
  if (!(query.size <= 0x1p1022)) {  // a difference overflowed, or scaling by halves would
    prescale = 0x1p-3;
    query = differences(features, prescale);
  }
  if (query.size == 0) return query;
  int exponent = 0;
  std::frexp(query.size, &exponent);
  const PowerOfTwo scale(-exponent);
  for (MovingVec3& v : query.from0) v = {scale(v.t0), scale(v.t1)};
  query.relative_motion = 0;
  for (int k = 0; k < query.gap_count; ++k) {
    query.gaps[k] = {scale(query.gaps[k].t0), scale(query.gaps[k].t1)};
    // sqrt(3) < 1.75 covers the norm and the roundings.
    query.relative_motion =
        std::max(query.relative_motion, 1.75 * max_abs(query.gaps[k].t1 - query.gaps[k].t0));
  }
  query.size = scale(query.size);
  // Beyond 2^100 sizes a separation always holds; the clamp keeps products finite.
  query.separation = min_separation > 0
                         ? std::min(scale(min_separation * prescale) * (1 + 0x1p-50) + 0x1p-1022, 0x1p100)
                         : 0;
  return query;
}

SeparatedTimes separated_times(const Query& query, const Vec3& direction) {
  const double threshold = 48 * kUnit * max_abs(direction) + 0x1p-1000 +
                           (query.separation > 0 ? query.separation * norm(direction) * (1 + 0x1p-45) : 0.0);
  SeparatedTimes separated{true, {0, 1}};
  for (int k = 0; k < query.gap_count; ++k) {
    const double p0 = dot(direction, query.gaps[k].t0) - threshold;
    const double p1 = dot(direction, query.gaps[k].t1) - threshold;
    if (p0 > 0) {
      if (!(p1 > 0)) separated.times.end = std::min(separated.times.end, p0 / (p0 - p1) - 0x1p-50);
    } else if (p1 > 0) {
      separated.times.begin = std::max(separated.times.begin, -p0 / (p1 - p0) + 0x1p-50);
    } else {
      return {};
    }
  }
  separated.any = separated.times.begin <= separated.times.end;
  return separated;
}

bool trim(Window& window, const SeparatedTimes& separated) {
  if (!separated.any) return true;
  const bool covers_begin = separated.times.begin <= window.begin;
  const bool covers_end = separated.times.end >= window.end;
  if (covers_begin && covers_end) return false;
  if (covers_begin) window.begin = std::max(window.begin, separated.times.end);
  if (covers_end) window.end = std::min(window.end, separated.times.begin);
  return window.begin <= window.end;
}

bool trim_by_kdop(const Query& query, Window& window) {
  static constexpr Vec3 kAxes[9] = {{1, 0, 0}, {0, 1, 0},  {0, 0, 1}, {1, 1, 0}, {1, -1, 0},
                                    {0, 1, 1}, {0, 1, -1}, {1, 0, 1}, {-1, 0, 1}};
  for (const Vec3& axis : kAxes) {
    // One sense at most can separate at t = 0 and one at t = 1: ask only those.
    double lo = std::numeric_limits<double>::infinity();
    double hi = -lo;
    double lo1 = lo;
    double hi1 = hi;
    for (int k = 0; k < query.gap_count; ++k) {
      const double p0 = dot(axis, query.gaps[k].t0);
      const double p1 = dot(axis, query.gaps[k].t1);
      lo = std::min(lo, p0);
      hi = std::max(hi, p0);
      lo1 = std::min(lo1, p1);
      hi1 = std::max(hi1, p1);
    }
    if ((lo > 0 || lo1 > 0) && !trim(window, separated_times(query, axis))) return false;
    if ((hi < 0 || hi1 < 0) && !trim(window, separated_times(query, {-axis.x, -axis.y, -axis.z})))
      return false;
  }
  return true;
}

Vec3 closest_direction(const Query& query, double t) {
  const Vec3 p1 = query.from0[0].at(t);
  const Vec3 p2 = query.from0[1].at(t);
  const Vec3 p3 = query.from0[2].at(t);
  return query.kind == ContactKind::kVertexFace ? closest_on_triangle(p1, p2, p3)
                                                : closest_between_edges(p1, p2, p3);
}

}  // namespace warmfront

// SPDX-License-Identifier: Apache-2.0
#include "engine/elementary/query.h"

#include <algorithm>
#include <cstdlib>
#include <span>

#include "engine/elementary/closest.h"
#include "engine/elementary/powers_of_two.h"
#include "engine/simd/lanes.h"

namespace warmfront {
namespace {

WARMFRONT_INLINE Vec3 difference(const std::array<double, 4>& to, const std::array<double, 4>& from,
                                 double prescale) {
  return {to[0] * prescale - from[0] * prescale, to[1] * prescale - from[1] * prescale,
          to[2] * prescale - from[2] * prescale};
}

WARMFRONT_INLINE MovingVec3 difference(const VertexMotion& to, const VertexMotion& from, double prescale) {
  return {difference(to.t0, from.t0, prescale), difference(to.t1, from.t1, prescale)};
}

// All differences, of coordinates times `prescale`. (Inlined, so that a factor of 1 costs nothing.)
WARMFRONT_INLINE Query differences(const FeatureVertices& features, double prescale) {
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

// 2^exponent as two factors, each within double's range.
struct PowerOfTwo {
  double a;
  double b;
  explicit PowerOfTwo(int exponent) {
    const int half = std::abs(exponent) < 1000 ? 0 : exponent / 2;
    a = power_of_two(exponent - half);
    b = power_of_two(half);
  }
  double operator()(double x) const { return b == 1 ? x * a : x * a * b; }
  Vec3 operator()(const Vec3& v) const { return {(*this)(v.x), (*this)(v.y), (*this)(v.z)}; }
};

// The times at which all gaps, linear between p0 and p1, exceed the threshold.
SeparatedTimes times_above(std::span<const double> p0, std::span<const double> p1, double threshold) {
  SeparatedTimes separated{true, {0, 1}};
  for (std::size_t k = 0; k < p0.size(); ++k) {
    const double q0 = p0[k] - threshold;
    const double q1 = p1[k] - threshold;
    if (q0 > 0) {
      if (!(q1 > 0)) separated.times.end = std::min(separated.times.end, q0 / (q0 - q1) - 0x1p-50);
    } else if (q1 > 0) {
      separated.times.begin = std::max(separated.times.begin, -q0 / (q1 - q0) + 0x1p-50);
    } else {
      return {};
    }
  }
  separated.any = separated.times.begin <= separated.times.end;
  return separated;
}

double threshold_for(const Query& query, double direction_max, double direction_norm) {
  const double slack = 48 * kUnit * direction_max + 0x1p-1000;
  return query.separation > 0 ? slack + query.separation * direction_norm * (1 + 0x1p-45) : slack;
}

}  // namespace

Query Query::prepare(const FeatureVertices& features, double min_separation) {
  double prescale = 1;
  Query query = differences(features, 1);
  if (!(query.size <= 0x1p1022)) {  // a difference overflowed, or scaling by halves would
    prescale = 0x1p-3;
    query = differences(features, 0x1p-3);
  }
  if (query.size == 0) return query;
  query.prescale = prescale;
  query.exponent = -exponent_of(query.size);
  const PowerOfTwo scale(query.exponent);
  for (MovingVec3& v : query.from0) v = {scale(v.t0), scale(v.t1)};
  query.relative_motion = 0;
  for (int k = 0; k < query.gap_count; ++k) {
    query.gaps[k] = {scale(query.gaps[k].t0), scale(query.gaps[k].t1)};
    // sqrt(3) < 1.75 covers the norm and the roundings.
    query.relative_motion =
        std::max(query.relative_motion, 1.75 * max_abs(query.gaps[k].t1 - query.gaps[k].t0));
  }
  query.size = scale(query.size);
  query.separation = query.scaled(min_separation);
  return query;
}

double Query::scaled(double length) const {
  if (!(length > 0)) return 0;
  // A separation above 2^100 sizes is never exceeded; the clamp keeps products finite.
  return std::min(PowerOfTwo(exponent)(length * prescale) * (1 + 0x1p-50) + 0x1p-1022, 0x1p100);
}

double Query::unscaled(double length) const {
  const double x = PowerOfTwo(-exponent)(length * (1 - 0x1p-50)) / prescale;
  return x < 0x1p-1000 ? std::max(0.0, x - 0x1p-1073) : x;  // two roundings where it is denormal
}

SeparatedTimes separated_times(const Query& query, const Vec3& direction) {
  std::array<double, 4> p0;
  std::array<double, 4> p1;
  for (int k = 0; k < query.gap_count; ++k) {
    p0[k] = dot(direction, query.gaps[k].t0);
    p1[k] = dot(direction, query.gaps[k].t1);
  }
  const auto count = static_cast<std::size_t>(query.gap_count);
  return times_above({p0.data(), count}, {p1.data(), count},
                     threshold_for(query, max_abs(direction), query.separation > 0 ? norm(direction) : 0));
}

double kept_along(const Query& query, const Vec3& direction) {
  const double length = norm(direction);
  if (!(length > 0)) return 0;
  double least = dot(direction, query.gaps[0].t0);
  for (int k = 1; k < query.gap_count; ++k) least = std::min(least, dot(direction, query.gaps[k].t0));
  return least / length * (1 - 0x1p-48) - 48 * kUnit;
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

namespace {

// The gaps projected on the nine axes, three vectors of three and a padding lane that never separates: (x, y,
// z), (x+y, y+z, z+x), (x-y, y-z, z-x); and their extremes over the gaps.
struct Projections {
  Double4 gap[4][3];
  Double4 lowest[3];
  Double4 highest[3];

  double at(int k, int axis) const { return gap[k][axis / 4][axis % 4]; }
};

WARMFRONT_INLINE void project(const Query& query, Vec3 MovingVec3::*end, Projections& to) {
  for (int k = 0; k < query.gap_count; ++k) {
    const auto& [x, y, z] = query.gaps[k].*end;
    const Double4 straight{x, y, z, 0};
    const Double4 rotated{y, z, x, 0};
    to.gap[k][0] = straight;
    to.gap[k][1] = straight + rotated;
    to.gap[k][2] = straight - rotated;
    for (int group = 0; group < 3; ++group) {
      const Double4 p = to.gap[k][group];
      to.lowest[group] = k == 0 ? p : lesser(p, to.lowest[group]);
      to.highest[group] = k == 0 ? p : greater(p, to.highest[group]);
    }
  }
}

// Bit 4 g + i: lane i of group g separates one end or the other in its positive sense; bit 16 + 4 g + i: in
// its negative sense.
WARMFRONT_TARGET_CLONES
std::uint32_t separating_senses(const Query& query, double straight, double diagonal, Projections& p0,
                                Projections& p1) {
  project(query, &MovingVec3::t0, p0);
  project(query, &MovingVec3::t1, p1);
  std::uint32_t bits = 0;
  for (int group = 0; group < 3; ++group) {
    const double threshold = group == 0 ? straight : diagonal;
    const auto positive = (Long4)((p0.lowest[group] > threshold) | (p1.lowest[group] > threshold));
    const auto negative = (Long4)((p0.highest[group] < -threshold) | (p1.highest[group] < -threshold));
    for (int i = 0; i < 3; ++i) {
      bits |= static_cast<std::uint32_t>(positive[i] & 1) << (4 * group + i);
      bits |= static_cast<std::uint32_t>(negative[i] & 1) << (16 + 4 * group + i);
    }
  }
  return bits;
}

}  // namespace

bool trim_by_kdop(const Query& query, Window& window) {
  const double straight = threshold_for(query, 1, 1);
  const double diagonal = threshold_for(query, 1, 1.4142135623730952);  // sqrt(2), rounded up
  Projections p0;
  Projections p1;
  for (std::uint32_t bits = separating_senses(query, straight, diagonal, p0, p1); bits != 0;
       bits &= bits - 1) {
    const int axis = std::countr_zero(bits) & 15;
    const double sense = std::countr_zero(bits) < 16 ? 1 : -1;
    std::array<double, 4> at0;
    std::array<double, 4> at1;
    for (int k = 0; k < query.gap_count; ++k) {
      at0[k] = sense * p0.at(k, axis);
      at1[k] = sense * p1.at(k, axis);
    }
    const auto count = static_cast<std::size_t>(query.gap_count);
    if (!trim(window,
              times_above({at0.data(), count}, {at1.data(), count}, axis < 4 ? straight : diagonal))) {
      return false;
    }
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

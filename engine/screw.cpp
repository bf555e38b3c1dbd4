// SPDX-License-Identifier: Apache-2.0
#include "engine/screw.h"

#include <cmath>
#include <cstddef>

#include "engine/part_way.h"

namespace warmfront {
namespace {

using Vector = std::array<double, 3>;

Vector cross(const Vector& a, const Vector& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

Vector sum(const Vector& a, const Vector& b) {
  return {a[0] + b[0], a[1] + b[1], a[2] + b[2]};
}

Vector scaled(double s, const Vector& a) {
  return {s * a[0], s * a[1], s * a[2]};
}

double squared(const Vector& a) {
  return a[0] * a[0] + a[1] * a[1] + a[2] * a[2];
}

Vector column(const Pose& pose, std::size_t k) {
  return {pose.matrix[k], pose.matrix[4 + k], pose.matrix[8 + k]};
}

// R1 R0^T, row-major.
std::array<double, 9> rotation_between(const Pose& from, const Pose& to) {
  std::array<double, 9> between;
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j) {
      const double* a = to.matrix.data() + 4 * i;
      const double* b = from.matrix.data() + 4 * j;
      between[3 * i + j] = (a[0] * b[0] + a[1] * b[1]) + a[2] * b[2];
    }
  }
  return between;
}

// A quaternion of the rotation, real part first and not negative, of some length from 1 to 4 (Shepperd's
// method: what is divided by is the largest of the four).
std::array<double, 4> quaternion_of(const std::array<double, 9>& r) {
  const double ww = 1 + ((r[0] + r[4]) + r[8]);
  const double xx = 1 + ((r[0] - r[4]) - r[8]);
  const double yy = 1 + ((r[4] - r[0]) - r[8]);
  const double zz = 1 + ((r[8] - r[0]) - r[4]);
  std::array<double, 4> q;
  if (ww >= xx && ww >= yy && ww >= zz)
    q = {ww, r[7] - r[5], r[2] - r[6], r[3] - r[1]};
  else if (xx >= yy && xx >= zz)
    q = {r[7] - r[5], xx, r[1] + r[3], r[2] + r[6]};
  else if (yy >= zz)
    q = {r[2] - r[6], r[1] + r[3], yy, r[5] + r[7]};
  else
    q = {r[3] - r[1], r[2] + r[6], r[5] + r[7], zz};
  if (q[0] < 0) {
    for (double& x : q) x = -x;
  }
  return q;
}

// 1 / (2 k + 1).
constexpr auto kTangent = [] {
  std::array<double, 16> of{};
  for (std::size_t k = 0; k < of.size(); ++k) of[k] = 1.0 / static_cast<double>(2 * k + 1);
  return of;
}();

// The angle of the point (x, y) with y >= 0, x >= 0: its tangent is halved three times, then the series of
// the arc tangent serves. Libraries' own functions differ from machine to machine.
double angle_of(double x, double y) {
  double t = y / (x + std::sqrt(x * x + y * y));
  for (int halved = 0; halved < 2; ++halved) t = t / (1 + std::sqrt(1 + t * t));
  const double square = t * t;
  double series = 0;
  for (std::size_t k = kTangent.size(); k-- > 0;) series = kTangent[k] - square * series;
  return 8 * (t * series);
}

/// What each term of a series is of the one before it, without the argument.
constexpr std::size_t kTerms = 14;
using Ratios = std::array<double, kTerms>;
template <class Ratio>
constexpr Ratios ratios_of(Ratio ratio) {
  Ratios ratios{};
  for (std::size_t k = 0; k < kTerms; ++k) ratios[k] = ratio(static_cast<double>(k + 1));
  return ratios;
}
constexpr Ratios kVersine = ratios_of([](double k) { return 1.0 / ((2 * k + 1) * (2 * k + 2)); });
constexpr Ratios kLag = ratios_of([](double k) { return 1.0 / ((2 * k + 2) * (2 * k + 3)); });
constexpr Ratios kCotangent = ratios_of([](double k) { return (k + 1) / (k * (2 * k + 3) * (2 * k + 4)); });

// How many terms leave out less than 2^-58 of the first: that is z^k 2 / (2 k + 2)! at most, after k.
std::size_t terms_for(double z) {
  if (z <= 0x1p-4) return 7;
  if (z <= 0.5) return 9;
  return z <= 2.75 ? 11 : kTerms;
}

// An alternating series in z, up to pi^2, whose terms fall as factorials.
double alternating(double z, double first, const Ratios& ratios) {
  double series = 1;
  for (std::size_t k = terms_for(z); k-- > 0;) series = 1 - (z * ratios[k]) * series;
  return first * series;
}

// (1 - cos a) / a^2, with z = a^2: terms 1 / (2 k + 2)!.
double versine(double z) {
  return alternating(z, 0.5, kVersine);
}

// (a - sin a) / a^3: terms 1 / (2 k + 3)!.
double lag(double z) {
  return alternating(z, 1.0 / 6, kLag);
}

// (1 - (a / 2) cot(a / 2)) / a^2: terms 2 (k + 1) / (2 k + 4)!, over twice the versine.
double cotangent_share(double z) {
  return alternating(z, 1.0 / 12, kCotangent) / (2 * versine(z));
}

}  // namespace

std::array<double, 3> Twist::bend_at(const std::array<double, 3>& x) const {
  const Vector from_centre{x[0] - centre[0], x[1] - centre[1], x[2] - centre[2]};
  return cross(angular, sum(cross(angular, from_centre), linear));
}

Twist twist_between(const Pose& from, const Pose& to) {
  Twist twist;
  twist.centre = column(from, 3);
  const Vector end = column(to, 3);
  for (std::size_t k = 0; k < 3; ++k) twist.linear[k] = end[k] - twist.centre[k];
  const std::array<double, 4> q = quaternion_of(rotation_between(from, to));
  const Vector imaginary{q[1], q[2], q[3]};
  const double length = std::sqrt(squared(imaginary));
  if (!(length > 0)) return twist;
  twist.angular = scaled(2 * angle_of(q[0], length) / length, imaginary);
  twist.angle_squared = squared(twist.angular);
  twist.chord_bend = versine(twist.angle_squared);
  twist.chord_turn = lag(twist.angle_squared);
  const Vector across = cross(twist.angular, twist.linear);
  const Vector back = scaled(cotangent_share(twist.angle_squared), cross(twist.angular, across));
  twist.linear = sum(sum(twist.linear, scaled(-0.5, across)), back);
  return twist;
}

ArcShares arc_shares(const Twist& twist, double s) {
  return arc_rates(twist, s).shares;
}

// sin(a s) / a = s (1 - (a s)^2 lag).
ArcRates arc_rates(const Twist& twist, double s) {
  if (s == 0) return {{}, {-twist.chord_bend, -twist.chord_turn}};
  const double square = s * s;
  const double z = twist.angle_squared * square;
  const double of_z = lag(z);
  const double bend = square * versine(z);
  return {{bend - s * twist.chord_bend, (square * s) * of_z - s * twist.chord_turn},
          {s * (1 - z * of_z) - twist.chord_bend, bend - twist.chord_turn}};
}

// The bend is affine in x = R0 X + t0: of a column of R0 it is angular x (angular x column), of t0, the
// centre, angular x linear.
Pose screw_way(const Pose& from, const Pose& to, double fraction, bool single) {
  if (fraction == 1) return to;
  if (fraction == 0) return from;
  const Twist twist = twist_between(from, to);
  if (twist.angle_squared == 0) return part_way(from, to, fraction, single);
  const ArcShares shares = arc_shares(twist, fraction);
  Pose pose = part_way(from, to, fraction, false);
  for (std::size_t k = 0; k < 4; ++k) {
    const Vector velocity = k < 3 ? cross(twist.angular, column(from, k)) : twist.linear;
    const Vector bend = cross(twist.angular, velocity);
    const Vector turn = cross(twist.angular, bend);
    for (std::size_t row = 0; row < 3; ++row) {
      double& entry = pose.matrix[4 * row + k];
      const double bent = entry + (shares.of_bend * bend[row] + shares.of_turn * turn[row]);
      if (std::isfinite(bent)) entry = bent;
    }
  }
  return single ? in_float32(pose) : pose;
}

}  // namespace warmfront

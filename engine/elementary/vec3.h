// SPDX-License-Identifier: Apache-2.0
// Small vector algebra for bounds and elementary tests: one IEEE rounding per operation, in a stated order,
// because the error bounds count roundings. (Eigen may reassociate its reductions.) Pure functions.
#pragma once

#include <algorithm>
#include <cmath>

namespace warmfront {

struct Vec3 {
  double x;
  double y;
  double z;
};

inline Vec3 operator+(const Vec3& a, const Vec3& b) {
  return {a.x + b.x, a.y + b.y, a.z + b.z};
}
inline Vec3 operator-(const Vec3& a, const Vec3& b) {
  return {a.x - b.x, a.y - b.y, a.z - b.z};
}
inline Vec3 operator*(double s, const Vec3& a) {
  return {s * a.x, s * a.y, s * a.z};
}
inline double dot(const Vec3& a, const Vec3& b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}
inline Vec3 cross(const Vec3& a, const Vec3& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
inline double max_abs(const Vec3& a) {
  return std::max({std::fabs(a.x), std::fabs(a.y), std::fabs(a.z)});
}
inline double norm(const Vec3& a) {
  return std::sqrt(dot(a, a));
}
/// (1 - t) a + t b.
inline double lerp(double a, double b, double t) {
  return a * (1.0 - t) + b * t;
}
inline Vec3 lerp(const Vec3& a, const Vec3& b, double t) {
  return {lerp(a.x, b.x, t), lerp(a.y, b.y, t), lerp(a.z, b.z, t)};
}

/// A vector that moves linearly over the step.
struct MovingVec3 {
  Vec3 t0;
  Vec3 t1;
  Vec3 at(double t) const { return lerp(t0, t1, t); }
};

/// Unit roundoff of double.
inline constexpr double kUnit = 0x1p-53;

}  // namespace warmfront

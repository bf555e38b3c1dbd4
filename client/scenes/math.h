// SPDX-License-Identifier: Apache-2.0
// Geometry for the built-in scenes, with the same bits on every IEEE machine: only +, -, *, / and sqrt, which
// IEEE 754 rounds uniquely, and never the C library's sine. Pure functions and values.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>

namespace warmfront::client::scenes {

struct Vec3 {
  double x = 0, y = 0, z = 0;
};
inline Vec3 operator+(Vec3 a, Vec3 b) {
  return {a.x + b.x, a.y + b.y, a.z + b.z};
}
inline Vec3 operator-(Vec3 a, Vec3 b) {
  return {a.x - b.x, a.y - b.y, a.z - b.z};
}
inline Vec3 operator*(double s, Vec3 a) {
  return {s * a.x, s * a.y, s * a.z};
}
inline Vec3& operator+=(Vec3& a, Vec3 b) {
  return a = a + b;
}
inline Vec3& operator-=(Vec3& a, Vec3 b) {
  return a = a - b;
}
inline double dot(Vec3 a, Vec3 b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}
inline Vec3 cross(Vec3 a, Vec3 b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
inline double norm(Vec3 a) {
  return std::sqrt(dot(a, a));
}

inline constexpr double kPi = 3.14159265358979323846;

struct SinCos {
  double sin = 0, cos = 1;
};

/// Sine and cosine of `angle` in radians by their Taylor series on [-pi/4, pi/4]; good to about 1e-15 for
/// small angles.
inline SinCos sin_cos(double angle) {
  const double quarter = std::floor(angle * (2 / kPi) + 0.5);
  const double r = angle - quarter * (kPi / 2);
  const double q = r * r;
  double s = 1, c = 1;
  for (int k = 16; k >= 2; k -= 2) {
    s = 1 - s * q / (k * (k + 1));
    c = 1 - c * q / (k * (k - 1));
  }
  s *= r;
  switch (static_cast<std::int64_t>(quarter) & 3) {
    case 1:
      return {c, -s};
    case 2:
      return {-s, -c};
    case 3:
      return {-c, s};
    default:
      return {s, c};
  }
}

/// A rotation about an axis through the origin, then a translation.
struct Pose {
  std::array<Vec3, 3> rows{Vec3{1, 0, 0}, Vec3{0, 1, 0}, Vec3{0, 0, 1}};
  Vec3 origin;

  Vec3 rotate(Vec3 p) const { return {dot(rows[0], p), dot(rows[1], p), dot(rows[2], p)}; }
  Vec3 apply(Vec3 p) const { return rotate(p) + origin; }
};

/// Rotation by `angle` about the unit vector `axis` (Rodrigues' formula), then translation to `origin`.
inline Pose turned(Vec3 axis, double angle, Vec3 origin) {
  const auto [s, c] = sin_cos(angle);
  const Vec3 a = (1 - c) * axis;
  return {{Vec3{c + a.x * axis.x, a.x * axis.y - s * axis.z, a.x * axis.z + s * axis.y},
           Vec3{a.y * axis.x + s * axis.z, c + a.y * axis.y, a.y * axis.z - s * axis.x},
           Vec3{a.z * axis.x - s * axis.y, a.z * axis.y + s * axis.x, c + a.z * axis.z}},
          origin};
}

/// PCG32 (O'Neill 2014), implemented here so that a scene is the same on every platform.
class Random {
 public:
  explicit Random(std::uint64_t seed) : state_(seed * 0x9e3779b97f4a7c15ULL + 1) { next(); }

  std::uint32_t next() {
    const std::uint64_t old = state_;
    state_ = old * 6364136223846793005ULL + 1442695040888963407ULL;
    const auto mixed = static_cast<std::uint32_t>(((old >> 18) ^ old) >> 27);
    const auto turn = static_cast<std::uint32_t>(old >> 59);
    return (mixed >> turn) | (mixed << ((32 - turn) & 31));
  }

  /// In [low, high).
  double uniform(double low, double high) { return low + (high - low) * (next() * 0x1p-32); }

 private:
  std::uint64_t state_;
};

}  // namespace warmfront::client::scenes

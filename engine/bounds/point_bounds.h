// SPDX-License-Identifier: Apache-2.0
// The bounds of one vertex in 32 bytes, from which its 18-DOPs are computed. Plain values.
#pragma once

#include <array>
#include <cstddef>

#include "engine/bounds/kdop.h"
#include "engine/simd/target_clones.h"

namespace warmfront {

/// A vertex at t = 0 and at t = 1: its local coordinates, and the margin by which its slabs along x, y and z
/// extend beyond them on either side. Along a diagonal they extend kDiagonal times as far beyond the sum or
/// difference of two coordinates. See point_bounds() for what the margin covers.
struct alignas(32) PointBounds {
  static constexpr float kDiagonal = 1.41422F;  // above sqrt(2)

  std::array<std::array<float, 4>, 2> at;  ///< by end of the step: x, y, z, margin

  bool operator==(const PointBounds&) const = default;
};

/// The ends of the slabs along axis k of an 18-DOP, one below and one (negated) above a point; for one lane
/// or many. All bounds of points are computed here, so that they have the same bits.
template <class Real>
struct SlabEnds {
  Real lower;
  Real upper;
};
template <class Real>
WARMFRONT_INLINE Real along_axis(std::size_t k, Real x, Real y, Real z) {
  switch (k) {
    case 0:
      return x;
    case 1:
      return y;
    case 2:
      return z;
    case 3:
      return x + y;
    case 4:
      return x - y;
    case 5:
      return y + z;
    case 6:
      return y - z;
    case 7:
      return z + x;
    default:
      return z - x;
  }
}
template <class Real>
WARMFRONT_INLINE SlabEnds<Real> slab_ends(std::size_t k, Real x, Real y, Real z, Real margin) {
  const Real at = along_axis(k, x, y, z);
  const Real beyond = k < 3 ? margin : PointBounds::kDiagonal * margin;
  return {at - beyond, -at - beyond};
}

/// The 18-DOPs of a point.
inline KDop18 bounds_of(const PointBounds& point) {
  KDop18 bounds;
  for (std::size_t t = 0; t < 2; ++t) {
    const auto [x, y, z, margin] = point.at[t];
    for (std::size_t k = 0; k < KDop18::kAxes; ++k) {
      const auto [lower, upper] = slab_ends(k, x, y, z, margin);
      bounds.lane[t * KDop18::kEnd + k] = lower;
      bounds.lane[t * KDop18::kEnd + KDop18::kAxes + k] = upper;
    }
  }
  return bounds;
}

}  // namespace warmfront

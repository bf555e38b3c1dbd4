// SPDX-License-Identifier: Apache-2.0
// How far apart two bounds must be before a question leaves them alone: its separation, added where bounds are
// compared. Bounds themselves know of none, so that the same ones serve questions of any separation in any
// order. Plain values.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

namespace warmfront {

/// Two bounds are apart where a slab of one lies beyond a slab of the other by more than this, at both ends of
/// the step. In the local frame, from above: the sign of a float sum minus a float is that of the sum rounded
/// to nearest minus it, so what seems to be beyond is.
struct Width {
  float straight = 0;  ///< along x, y, z
  float diagonal = 0;  ///< along the other axes, whose vectors are sqrt(2) long

  /// Of a separation >= 0. Rounded up by more than the elementary cascade's own rounding of it (u = 2^-53 of
  /// it, times sqrt(2)): see moving.h.
  static Width of(double local_length) {
    // Bounds reach 2^100 at most, or contain everything.
    constexpr double kMost = 0x1p120;
    constexpr double kSqrt2Up = 1.4142135623730952;  // >= sqrt(2)
    if (!(local_length > 0)) return {};
    const double length = std::min(local_length, kMost) * (1 + 0x1p-20);
    const auto up = [](double x) {
      return std::nextafter(static_cast<float>(x), std::numeric_limits<float>::infinity());
    };
    return {up(length), up(kSqrt2Up * length)};
  }

  bool none() const { return straight == 0; }
  /// Along axis k of an 18-DOP or an AABB.
  float along(int axis) const { return axis < 3 ? straight : diagonal; }

  friend bool operator==(const Width&, const Width&) = default;
};

}  // namespace warmfront

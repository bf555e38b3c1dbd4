// SPDX-License-Identifier: Apache-2.0
// Bounding volumes: slabs along fixed axes, AABB (3 axes) and 18-DOP (9 axes). Plain values.
// Source: Klosowski et al. 1998; Tang, Manocha, Tong 2009, section 6.1.
#pragma once

#include <array>
#include <limits>

namespace warmfront {

/// Slabs along `Axes` directions in float32. Lower ends are held as they are and upper ends negated, so that
/// one `min` merges all lanes and one sum compares a lower end with an upper end. Every value was rounded
/// outward. Lanes are never +infinity (that would be an empty slab), so no sum of two of them is NaN.
template <int Axes>
struct Slabs {
  static constexpr int kAxes = Axes;
  std::array<float, 2 * Axes> lane;  ///< lower ends of axes 0.., then negated upper ends of axes 0..

  /// The identity of merge(): holds nothing.
  static Slabs empty() {
    Slabs slabs;
    slabs.lane.fill(std::numeric_limits<float>::max());
    return slabs;
  }

  void merge(const Slabs& other) {
    for (int k = 0; k < 2 * Axes; ++k) lane[k] = lane[k] < other.lane[k] ? lane[k] : other.lane[k];
  }

  float lower(int axis) const { return lane[axis]; }
  float upper(int axis) const { return -lane[axis + Axes]; }
};

using Aabb = Slabs<3>;
/// Axes x, y, z, x+y, x-y, y+z, y-z, z+x, z-x (not normalised).
using KDop18 = Slabs<9>;

/// The AABB within an 18-DOP; the 18-DOP itself.
template <class Bounds>
Bounds narrow(const KDop18& kdop);
template <>
inline KDop18 narrow<KDop18>(const KDop18& kdop) {
  return kdop;
}
template <>
inline Aabb narrow<Aabb>(const KDop18& kdop) {
  return {{kdop.lane[0], kdop.lane[1], kdop.lane[2], kdop.lane[9], kdop.lane[10], kdop.lane[11]}};
}

}  // namespace warmfront

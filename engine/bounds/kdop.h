// SPDX-License-Identifier: Apache-2.0
// Bounding volumes of moving things: slabs along fixed axes, AABB (3 axes) and 18-DOP (9 axes). Plain values.
// Source: Klosowski et al. 1998; Tang, Manocha, Tong 2009, section 6.1, whose swept volumes these refine.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <limits>

namespace warmfront {

/// The bounds of points that move linearly from t = 0 to t = 1: slabs along `Axes` directions at both ends of
/// the step. Two bounds are apart when one axis has all of one beyond all of the other, on the same side at
/// both ends: every gap between two vertices is linear in time, so it stays open in between. Common motion
/// does not matter, unlike for a volume swept from t = 0 to t = 1: such volumes are apart only where these
/// are.
///
/// In float32. Upper ends are stored negated, so that one `min` merges all lanes and one sum compares a lower
/// end with an upper end. Every value is rounded outward. Lanes are never +infinity (an empty slab), so no
/// sum of two of them is NaN.
template <int Axes>
struct Slabs {
  static constexpr int kAxes = Axes;
  static constexpr int kEnd = 2 * Axes;  ///< where the lanes of t = 1 begin
  /// Lower ends of axes 0.., then negated upper ends of axes 0.., at t = 0; then the same at t = 1.
  std::array<float, 4 * Axes> lane;

  /// The identity of merge(): empty.
  [[gnu::always_inline]] static Slabs empty() {
    Slabs slabs;
    slabs.lane.fill(std::numeric_limits<float>::max());
    return slabs;
  }

  [[gnu::always_inline]] void merge(const Slabs& other) {
    for (std::size_t k = 0; k < lane.size(); ++k) lane[k] = lane[k] < other.lane[k] ? lane[k] : other.lane[k];
  }

  /// Starts the next step: t = 1 becomes t = 0.
  [[gnu::always_inline]] void shift() { std::copy_n(lane.data() + kEnd, kEnd, lane.data()); }

  /// The sum of the three widths.
  double extent() const {
    return double{upper(0) - lower(0)} + double{upper(1) - lower(1)} + double{upper(2) - lower(2)};
  }
  /// Lower end over the whole step.
  float lower(int axis) const { return std::min(lane[axis], lane[axis + kEnd]); }
  float upper(int axis) const { return -std::min(lane[axis + Axes], lane[axis + Axes + kEnd]); }
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
  const auto& k = kdop.lane;
  return {{k[0], k[1], k[2], k[9], k[10], k[11], k[18], k[19], k[20], k[27], k[28], k[29]}};
}

}  // namespace warmfront

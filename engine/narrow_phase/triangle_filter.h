// SPDX-License-Identifier: Apache-2.0
// The stage before feature pairs: planes that keep two triangles apart for the whole step, eight pairs at a
// time.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "engine/bounds/point_bounds.h"

namespace warmfront {

/// The vertices of up to eight pairs of triangles: by corner (the first one's three, then the second one's)
/// and pair.
struct EightTrianglePairs {
  std::array<std::array<std::uint32_t, 8>, 6> vertex;
};

/// Before stage T0: bit i is set where a plane that only translates keeps pair i apart for the whole step,
/// farther than the separation that `points` were made with, and that by more than `reach` times the size of
/// any pair of features: certified_reach(), or 2^-18 at least. So none of its features has a contact, nor is
/// reported by any tier (README.md, "What certified reports"): what goes here would go in any case, whatever
/// frame the points are in. Planes tried: along either triangle, and along the mean relative motion and an
/// edge of either. The same on every instruction set. Source: reference/algorithms 3.5; the separating axis
/// theorem, seen along the motion.
std::uint32_t triangles_apart(const EightTrianglePairs& pairs, std::span<const PointBounds> points,
                              double reach);

}  // namespace warmfront

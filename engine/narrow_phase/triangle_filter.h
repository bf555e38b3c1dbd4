// SPDX-License-Identifier: Apache-2.0
// The stage before feature pairs: planes that separate two triangles for the whole step, eight pairs at a
// time.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "engine/bounds/point_bounds.h"

namespace warmfront {

/// The vertices of up to eight pairs of triangles: by corner (three of the first, then three of the second)
/// and pair.
struct EightTrianglePairs {
  std::array<std::array<std::uint32_t, 8>, 6> vertex;
  std::array<float, 8> width{};  ///< of each pair, along any direction: Width::straight
  std::array<float, 8> until{};  ///< read by triangles_apart_until()
};

/// Before stage T0: bit i is set where a plane that only translates separates pair i for the whole step, by
/// more than its width, beyond it by more than `reach` times the size of any pair of features:
/// certified_reach(), or at least 2^-18. So none of its features has a contact, and no tier reports
/// one (elementary/README.md, "What certified reports"): the removed pairs would not be reported in any
/// frame. Planes tried: along either triangle, and along the mean relative motion and an edge of either. The
/// same on every instruction set. Source: reference/algorithms 3.5; the separating axis theorem, seen along
/// the motion.
std::uint32_t triangles_apart(const EightTrianglePairs& pairs, std::span<const PointBounds> points,
                              double reach);

/// The same up to the time `until` of each pair, at most 1: whatever the tiers certified and exact report of
/// a removed pair is later. Where that is soon, the planes tried are along either triangle, and along an edge
/// of each, so that of triangles that hardly move by then and stay apart nearly all are removed.
std::uint32_t triangles_apart_until(const EightTrianglePairs& pairs, std::span<const PointBounds> points,
                                    double reach);

}  // namespace warmfront

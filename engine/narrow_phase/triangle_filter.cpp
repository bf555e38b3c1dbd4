// SPDX-License-Identifier: Apache-2.0
#include "engine/narrow_phase/triangle_filter.h"

#include <cstring>

#include "engine/bounds/eight_points.h"
#include "engine/simd/lanes3.h"

namespace warmfront {
namespace {

using Eight3 = Lanes3<Float8>;

// Eight pairs of triangles, by end of the step and corner, relative to the first corner.
struct Corners {
  Eight3 at[2][6];
  Float8 margin{};  // sum of the vertex margins of both triangles and the width
  Float8 size{};    // the largest coordinate

  WARMFRONT_INLINE Corners(const EightTrianglePairs& pairs, std::span<const PointBounds> points) {
    Float8 most[2]{};
    for (std::size_t t = 0; t < 2; ++t) {
      Eight3 origin{};
      for (std::size_t k = 0; k < 6; ++k) {
        const EightPoints p(points, pairs.vertex[k], t);
        if (k == 0) origin = {p.x, p.y, p.z};
        const Eight3 q = Eight3{p.x, p.y, p.z} - origin;
        at[t][k] = q;
        size = greater(largest_of(magnitudes(q)), size);
        most[k / 3] = greater(p.margin, most[k / 3]);
      }
    }
    Float8 width;
    std::memcpy(&width, pairs.width.data(), sizeof width);
    margin = most[0] + most[1] + width;
  }

  // The end of the motion becomes these times; the size stays that of all of it, as a query's is.
  WARMFRONT_INLINE void stop_at(const Float8& times) {
    for (std::size_t k = 0; k < 6; ++k) {
      const Eight3 way = at[1][k] - at[0][k];
      at[1][k] = at[0][k] + Eight3{times * way.x, times * way.y, times * way.z};
    }
  }
};

// An upper bound of the length of a vector with these magnitudes, at most a twelfth more: in descending
// order, x + (sqrt(2) - 1) y + (sqrt(3) - sqrt(2)) z, which is linear, above the convex length, and equal to
// it at (1, 0, 0), (1, 1, 0) and (1, 1, 1).
WARMFRONT_INLINE Float8 length_above(const Eight3& size, Float8 largest) {
  const Float8 least = lesser(lesser(size.x, size.y), size.z);
  const Float8 middle = ((size.x + size.y) + size.z) - largest - least;
  return (largest + 0.41422F * middle + 0.31785F * least) * (1 + 0x1p-20F);
}

// Where `direction` d separates the triangles of a pair at both ends of the step. Corners move linearly, and
// so do their differences along d: beyond 0 at both ends, beyond 0 throughout.
//
// Error bound, u = 2^-24, with |d| and |p| the largest coordinates. A vertex lies within its margin of its
// position, in any direction (point_bounds(): the margin includes eight roundings, of which three coordinates
// need less than two). A corner has one rounding, a product of three terms three more a term, 12 u |d| |p|;
// so two of them and their difference are within 30 u |d| |p|. Products that underflow are far below 2^-110.
// The reach of a contact: a pair of features has size at most 2 |p| and d length at most sqrt(3) |d|, so 4
// reaches of |d| |p| exceed it, and are at least 2^8 u.
WARMFRONT_INLINE Int8 keeps_apart(const Corners& corners, const Eight3& direction, float closest) {
  const Eight3 size = magnitudes(direction);
  const Float8 largest = largest_of(size);
  const Float8 slack =
      length_above(size, largest) * corners.margin + closest * largest * corners.size + 0x1p-110F;
  Float8 above[2];  // the second triangle above the first one
  Float8 below[2];
#pragma GCC unroll 2
  for (int t = 0; t < 2; ++t) {
    const auto along = [&](int k) { return dot(direction, corners.at[t][k]); };
    const Float8 a = along(0);
    const Float8 b = along(1);
    const Float8 c = along(2);
    const Float8 d = along(3);
    const Float8 e = along(4);
    const Float8 f = along(5);
    above[t] = lesser(lesser(d, e), f) - greater(greater(a, b), c);
    below[t] = lesser(lesser(a, b), c) - greater(greater(d, e), f);
  }
  return (Int8)(greater(lesser(above[0], above[1]), lesser(below[0], below[1])) > slack);
}

// Twice their mean over the step: those of the first triangle, then of the second.
struct Edges {
  Eight3 of[6];

  WARMFRONT_INLINE explicit Edges(const Corners& corners) {
    Eight3 place[6];
#pragma GCC unroll 6
    for (int k = 0; k < 6; ++k) place[k] = corners.at[0][k] + corners.at[1][k];
#pragma GCC unroll 6
    for (int k = 0; k < 6; ++k) of[k] = place[k % 3 == 2 ? k - 2 : k + 1] - place[k];
  }
};

// Where a plane along either triangle separates.
WARMFRONT_INLINE Int8 apart_along_faces(const Corners& corners, const Edges& edge, float closest) {
  return keeps_apart(corners, cross(edge.of[0], edge.of[1]), closest) |
         keeps_apart(corners, cross(edge.of[3], edge.of[4]), closest);
}

// Where some plane separates.
WARMFRONT_INLINE Int8 certainly_apart(const Corners& corners, float closest) {
  const auto way = [&](int k) { return corners.at[1][k] - corners.at[0][k]; };
  const Eight3 motion = ((way(3) - way(0)) + (way(4) - way(1))) + (way(5) - way(2));
  const Edges edge(corners);
  Int8 apart = apart_along_faces(corners, edge, closest);
  for (int k = 0; k < 6; ++k) {
    if (bits_of(apart) == 0xff) break;
    apart |= keeps_apart(corners, cross(edge.of[k], motion), closest);
  }
  return apart & (corners.size < 0x1p30F);  // no overflow
}

// Until then triangles are taken not to move much.
constexpr float kSoon = 0x1p-4F;

// The same of what hardly moves, and so may be looked at as if it did not: by the separating axis theorem of
// two triangles at rest.
WARMFRONT_INLINE Int8 certainly_apart_at_rest(const Corners& corners, float closest) {
  const Edges edge(corners);
  Int8 apart = apart_along_faces(corners, edge, closest);
  for (int k = 0; k < 9; ++k) {
    if (bits_of(apart) == 0xff) break;
    apart |= keeps_apart(corners, cross(edge.of[k / 3], edge.of[3 + k % 3]), closest);
  }
  return apart & (corners.size < 0x1p30F);
}

// 4 reaches, as keeps_apart() has them.
float closest_of(double reach) {
  return static_cast<float>(4.001 * reach);
}

}  // namespace

WARMFRONT_TARGET_CLONES
std::uint32_t triangles_apart(const EightTrianglePairs& pairs, std::span<const PointBounds> points,
                              double reach) {
  return bits_of(certainly_apart(Corners(pairs, points), closest_of(reach)));
}

// A corner of a time between has three more roundings, of values up to 2 |p|: 15 u |d| |p| in its product,
// and 30 in a difference of two, which the 2^-18 that is added covers.
WARMFRONT_TARGET_CLONES
std::uint32_t triangles_apart_until(const EightTrianglePairs& pairs, std::span<const PointBounds> points,
                                    double reach) {
  Corners corners(pairs, points);
  Float8 until;
  std::memcpy(&until, pairs.until.data(), sizeof until);
  corners.stop_at(until);
  const float closest = closest_of(reach) + 0x1p-18F;
  return bits_of(largest(until) < kSoon ? certainly_apart_at_rest(corners, closest)
                                        : certainly_apart(corners, closest));
}

}  // namespace warmfront

// SPDX-License-Identifier: Apache-2.0
// The polygons of differences between the primitives of pairs (elementary/exact_polygon.h), four pairs at a
// time, one per lane. Only for sources that dispatch by instruction set.
#pragma once

#include <array>
#include <cstring>
#include <span>

#include "engine/motion/motion.h"
#include "engine/narrow_phase/feature_block.h"
#include "engine/simd/lanes3.h"

namespace warmfront::difference_polygons {

inline constexpr int kLanes = 4;
using Lanes = Double4;
using Mask = decltype(Lanes{} < Lanes{});
using Four3 = Lanes3<Lanes>;
/// A triangle, whose first corner stands again at the end, or a parallelogram, in order around.
using Corners = Four3[4];

/// Where vertices are: x, y, z and padding.
using Place = std::array<double, 4>;

// One corner of four pairs.
WARMFRONT_INLINE void subtract(const Place* const (&places)[kLanes][2], Four3& to) {
  Lanes of[kLanes];  // a pair's difference: x, y, z and padding
  for (int i = 0; i < kLanes; ++i) {
    Lanes minuend;
    Lanes subtrahend;
    std::memcpy(&minuend, places[i][0]->data(), sizeof minuend);
    std::memcpy(&subtrahend, places[i][1]->data(), sizeof subtrahend);
    of[i] = minuend - subtrahend;
  }
  const Lanes xz01 = shuffle<0, 4, 2, 6>(of[0], of[1]);
  const Lanes xz23 = shuffle<0, 4, 2, 6>(of[2], of[3]);
  const Lanes y01 = shuffle<1, 5, 3, 7>(of[0], of[1]);
  const Lanes y23 = shuffle<1, 5, 3, 7>(of[2], of[3]);
  to.x = shuffle<0, 1, 4, 5>(xz01, xz23);
  to.y = shuffle<0, 1, 4, 5>(y01, y23);
  to.z = shuffle<2, 3, 6, 7>(xz01, xz23);
}

/// The pairs' corners, with vertex v at place_of(v); one rounding a coordinate.
template <class PlaceOf>
WARMFRONT_INLINE void gather(const FeaturePair* const (&pairs)[kLanes], const PlaceOf& place_of,
                             Corners& to) {
  // The vertices whose difference is a corner: one of the second primitive minus one of the first.
  constexpr int kCorners[2][4][2]{{{1, 0}, {2, 0}, {3, 0}, {1, 0}}, {{2, 0}, {3, 0}, {3, 1}, {2, 1}}};
  for (int k = 0; k < 4; ++k) {
    const Place* places[kLanes][2];
    for (int i = 0; i < kLanes; ++i) {
      const auto& corner = kCorners[pairs[i]->kind != ContactKind::kVertexFace][k];
      for (int of = 0; of < 2; ++of) places[i][of] = &place_of(pairs[i]->vertices[corner[of]]);
    }
    subtract(places, to[k]);
  }
}

/// The same at one end of the step, VertexMotion::t0 or t1.
WARMFRONT_INLINE void gather(const FeaturePair* const (&pairs)[kLanes],
                             std::span<const VertexMotion> vertices, Place VertexMotion::*end, Corners& to) {
  gather(
      pairs, [&](std::uint32_t v) -> const Place& { return vertices[v].*end; }, to);
}

/// The largest coordinate of any corner.
WARMFRONT_INLINE Lanes size_of(const Corners& corners) {
  Lanes size{};
  for (const Four3& corner : corners) size = greater(size, largest_of(magnitudes(corner)));
  return size;
}

/// Bit i is set where lane i is.
WARMFRONT_INLINE unsigned bits_of(const Mask& mask) {
  unsigned bits = 0;
  for (int i = 0; i < kLanes; ++i) bits |= static_cast<unsigned>(mask[i] & 1) << i;
  return bits;
}

}  // namespace warmfront::difference_polygons

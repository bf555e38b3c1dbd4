// SPDX-License-Identifier: Apache-2.0
#include "engine/motion/longest_way.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>

#include "engine/motion/range_grains.h"
#include "engine/parallel/stoppable_loops.h"

namespace warmfront {
double length_above(double x, double y, double z) {
  const double square = x * x + y * y + z * z;
  if (square > 0x1p-900 && square < 0x1p900)  // squares serve well within double's range
    return std::sqrt(square) * (1 + 0x1p-50);
  if (std::isinf(x) || std::isinf(y) || std::isinf(z)) return std::numeric_limits<double>::infinity();
  return std::hypot(x, y, z) * (1 + 0x1p-50);
}

double way_of(const VertexMotion& vertex) {
  return length_above(vertex.t1[0] - vertex.t0[0], vertex.t1[1] - vertex.t0[1], vertex.t1[2] - vertex.t0[2]);
}

double longest_way(const SceneMotion& motion, const Arcs& arcs, StopSignal stop) {
  std::atomic<double> longest{0};
  const auto take = [&](double way) {
    double before = longest.load(std::memory_order_relaxed);
    while (way > before && !longest.compare_exchange_weak(before, way, std::memory_order_relaxed)) {
    }
  };
  PacedStop paced(stop);
  for (PartId p{0}; p < motion.end_part(); ++p) {
    paced.check();
    if ((motion.state(p) & kMoving) == 0) continue;
    const auto of_some = [&](std::size_t first, std::size_t end) {
      double way = 0;
      for (std::size_t i = first; i < end; ++i)
        way = std::max(way, way_of(motion.vertex(p, static_cast<std::uint32_t>(i))));
      take(way + arcs.most_of(p));
    };
    if (!motion.unplaced(p) && motion.range(p).listed) {
      for (const std::uint32_t v : motion.range(p).changed) take(way_of(motion.vertices().vertices()[v]));
    } else if (motion.vertex_count(p) <= kGrain) {
      of_some(0, motion.vertex_count(p));
    } else {
      for_pieces(0, motion.vertex_count(p), kGrain, stop, of_some);
    }
  }
  return longest.load(std::memory_order_relaxed);
}

}  // namespace warmfront

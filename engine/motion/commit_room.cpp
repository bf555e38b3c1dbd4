// SPDX-License-Identifier: Apache-2.0
#include "engine/motion/commit_room.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>

#include "engine/parallel/stoppable_loops.h"

namespace warmfront {
namespace {

constexpr double kMost = std::numeric_limits<double>::max();

double translation_of(const Pose& pose) {
  return std::max({std::fabs(pose.matrix[3]), std::fabs(pose.matrix[7]), std::fabs(pose.matrix[11])});
}

}  // namespace

void CommitRoom::take(Rounding rounding, const SceneMotion& motion, const Arcs& arcs,
                      std::span<const std::uint32_t> body_of_vertex, StopSignal stop) {
  const bool single = rounding == Rounding::kFloat32;
  forget();
  posed_.clear();
  body_of_vertex_ = body_of_vertex;
  const double share = single ? 0x1p-22 : 0x1p-48;
  const LocalTransform& frame = motion.vertices().frame();
  double size = 0;  // of every coordinate
  for (const double x : frame.origin) size = std::max(size, std::fabs(x));
  size = std::min(size + frame.to_scene(motion.vertices().magnitude()), kMost);
  double most = share * size;
  PacedStop paced(stop);
  for (PartId p{0}; p < motion.end_part(); ++p) {
    paced.check();
    if (!motion.turns(p)) continue;
    if (posed_.empty()) lengthen(posed_, motion.part_count(), Posed{}, stop);
    const auto [start, end] = motion.poses(p);
    Posed& posed = posed_[number_of(p)];
    posed.share = single || arcs.of_part(p) == nullptr ? share : 0x1p-40;
    posed.translation = std::max(translation_of(start), translation_of(end));
    most = std::max(most, posed.of(size));
  }
  most_ = most * (1 + 0x1p-40);
  share_ = share;
}

double CommitRoom::of(std::span<const std::uint32_t> vertices, std::span<const VertexMotion> motions) const {
  double most = 0;
  for (const std::uint32_t v : vertices) {
    const VertexMotion& vertex = motions[v];
    double size = 0;
    bool rests = true;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      size = std::max({size, std::fabs(vertex.t0[axis]), std::fabs(vertex.t1[axis])});
      rests &= vertex.t0[axis] == vertex.t1[axis];
    }
    if (rests) continue;
    const bool posed = !posed_.empty() && posed_[body_of_vertex_[v]].share > 0;
    most = std::max(most, posed ? posed_[body_of_vertex_[v]].of(size) : share_ * size);
  }
  return most;
}

}  // namespace warmfront

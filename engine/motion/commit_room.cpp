// SPDX-License-Identifier: Apache-2.0
#include "engine/motion/commit_room.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <limits>

#include "engine/parallel/stoppable_loops.h"

namespace warmfront {
namespace {

constexpr double kMost = std::numeric_limits<double>::max();

double size_of(const VertexMotion& vertex) {
  double size = 0;
  for (std::size_t axis = 0; axis < 3; ++axis)
    size = std::max({size, std::fabs(vertex.t0[axis]), std::fabs(vertex.t1[axis])});
  return size;
}

double translation_of(const Pose& pose) {
  return std::max({std::fabs(pose.matrix[3]), std::fabs(pose.matrix[7]), std::fabs(pose.matrix[11])});
}

}  // namespace

void CommitRoom::take(Rounding rounding, const SceneMotion& motion, const CollisionModel& model,
                      std::span<const std::uint32_t> body_of_vertex, StopSignal stop) {
  const bool single = rounding == Rounding::kFloat32;
  forget();
  posed_.clear();
  body_of_vertex_ = body_of_vertex;
  const double share = single ? 0x1p-22 : 0x1p-44;
  const LocalTransform& frame = motion.vertices().frame();
  double origin = 0;
  for (const double x : frame.origin) origin = std::max(origin, std::fabs(x));
  double most = 0;
  PacedStop paced(stop);
  for (PartId p{0}; p < motion.end_part(); ++p) {
    paced.check();
    const bool turns = motion.turns(p);
    if (!turns && (motion.state(p) & kMoving) == 0) continue;
    const double size = std::min(origin + frame.to_scene(motion.reach(p)), kMost);
    most = std::max(most, share * size);
    if (!turns) continue;
    if (posed_.empty()) lengthen(posed_, motion.part_count(), Posed{}, stop);
    const auto [start, end] = motion.poses(p);
    Posed& posed = posed_[number_of(p)];
    posed.share = single ? share : std::ranges::binary_search(model.screws(), p) ? 0x1p-40 : 0x1p-42;
    posed.translation = std::max(translation_of(start), translation_of(end));
    most = std::max(most, posed.of(size));
  }
  // Beside the vertex's own: of any vertex, as far out as SceneMotion::reach() allows for.
  double most_of_half_space = 0;
  const double all = std::min(origin + 4 * frame.to_scene(motion.vertices().magnitude()), kMost);
  for (const CollisionModel::HalfSpaceOf& half_space : model.half_spaces()) {
    paced.check();
    if (posed_.empty() || posed_[number_of(half_space.part)].share == 0) continue;
    const Posed& posed = posed_[number_of(half_space.part)];
    double point = posed.translation;
    for (const double x : half_space.at_rest.point) point += std::fabs(x);
    most_of_half_space = std::max(most_of_half_space,
                                  posed.of(std::min(all, kMost / 8)) + posed.of(std::min(point, kMost / 8)));
  }
  least_ = single ? 0x1p-148 : 0x1p-1070;
  most_ = (most + most_of_half_space) * (1 + 0x1p-40) + 2 * least_;
  share_ = share;
}

double CommitRoom::of(std::span<const std::uint32_t> vertices, std::span<const VertexMotion> motions) const {
  double most = 0;
  for (const std::uint32_t v : vertices) most = std::max(most, of(v, motions[v]));
  return most;
}

double CommitRoom::of(std::uint32_t vertex, const VertexMotion& motion, std::uint32_t body,
                      double farthest) const {
  const double own = of(vertex, motion);
  if (posed_.empty() || posed_[body].share == 0) return own;
  return own + (posed_[body].of(size_of(motion)) + posed_[body].of(farthest) + least_);
}

double CommitRoom::of(std::uint32_t vertex, const VertexMotion& motion) const {
  if (!posed_.empty() && posed_[body_of_vertex_[vertex]].share > 0)
    return posed_[body_of_vertex_[vertex]].of(size_of(motion)) + least_;
  const bool rests = std::memcmp(motion.t0.data(), motion.t1.data(), 3 * sizeof(double)) == 0;
  return rests ? 0 : share_ * size_of(motion) + least_;
}

}  // namespace warmfront

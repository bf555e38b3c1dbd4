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

bool is_single(const VertexMotion& vertex) {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    for (const double x : {vertex.t0[axis], vertex.t1[axis]}) {
      if (static_cast<double>(static_cast<float>(x)) != x) return false;
    }
  }
  return true;
}

bool is_single(const Pose& pose) {
  return std::ranges::all_of(pose.matrix,
                             [](double x) { return static_cast<double>(static_cast<float>(x)) == x; });
}

bool has_rotation_of(const Pose& a, const Pose& b) {
  for (std::size_t i = 0; i < a.matrix.size(); ++i) {
    if (i % 4 != 3 && a.matrix[i] != b.matrix[i]) return false;
  }
  return true;
}

double translation_of(const Pose& pose) {
  return std::max({std::fabs(pose.matrix[3]), std::fabs(pose.matrix[7]), std::fabs(pose.matrix[11])});
}

double share_of(Rounding rounding) {
  return rounding == Rounding::kFloat32 ? 0x1p-22 : 0x1p-44;
}

double origin_size(const LocalTransform& frame) {
  return std::max({std::fabs(frame.origin[0]), std::fabs(frame.origin[1]), std::fabs(frame.origin[2])});
}

PosedRoom posed_room(Rounding rounding, const SceneMotion& motion, const CollisionModel& model, PartId part) {
  const auto [start, end] = motion.poses(part);
  const bool along_screw = std::ranges::binary_search(model.screws(), part);
  const bool single = rounding == Rounding::kFloat32;
  const bool translates =
      has_rotation_of(start, end) && (!single || (is_single(start) && is_single(end)));  // no arc then
  return {single        ? share_of(rounding)
          : along_screw ? 0x1p-40
                        : 0x1p-42,
          std::max(translation_of(start), translation_of(end)), !translates};
}

}  // namespace

void CommitRoom::take(Rounding rounding, const SceneMotion& motion, const CollisionModel& model,
                      std::span<const std::uint32_t> body_of_vertex, StopSignal stop) {
  const bool single = rounding == Rounding::kFloat32;
  forget();
  posed_.clear();
  body_of_vertex_ = body_of_vertex;
  single_ = single;
  const LocalTransform& frame = motion.vertices().frame();
  double most = 0;
  PacedStop paced(stop);
  for (PartId p{0}; p < motion.end_part(); ++p) {
    paced.check();
    const bool turns = motion.turns(p);
    if (!turns && (motion.state(p) & kMoving) == 0) continue;
    most = std::max(most, most_commit_room(rounding, motion, model, p));
    if (!turns) continue;
    if (posed_.empty()) lengthen(posed_, motion.part_count(), PosedRoom{}, stop);
    posed_[number_of(p)] = posed_room(rounding, motion, model, p);
  }
  // Beside the vertex's own: of any vertex, as far out as SceneMotion::reach() allows for.
  double most_of_half_space = 0;
  const double all =
      std::min(origin_size(frame) + 4 * frame.to_scene(motion.vertices().magnitude()), kMost / 8);
  farthest_ = 2 * all;
  for (const CollisionModel::HalfSpaceOf& half_space : model.half_spaces()) {
    paced.check();
    const auto [start, end] = motion.poses(half_space.part);
    double point = std::max(translation_of(start), translation_of(end));
    for (const double x : half_space.at_rest.point) point += std::fabs(x);
    point = std::min(point, kMost / 8);
    farthest_ = std::max(farthest_, all + point);
    if (posed_.empty() || posed_[number_of(half_space.part)].share == 0) continue;
    const PosedRoom& posed = posed_[number_of(half_space.part)];
    most_of_half_space = std::max(most_of_half_space, posed.of(all) + posed.of(point));
  }
  least_ = single ? 0x1p-148 : 0x1p-1070;
  most_ = (most + most_of_half_space) * (1 + 0x1p-40) + 2 * least_;
  share_ = share_of(rounding);
}

double CommitRoom::of(std::span<const std::uint32_t> vertices, std::span<const VertexMotion> motions) const {
  double most = 0;
  for (const std::uint32_t v : vertices) most = std::max(most, of(v, motions[v]));
  return most;
}

bool CommitRoom::by_themselves(std::span<const std::uint32_t> vertices,
                               std::span<const VertexMotion> motions) const {
  return std::ranges::none_of(vertices, [&](std::uint32_t v) {
    return goes_by_poses(body_of_vertex_[v]) || (single_ && !is_single(motions[v]));
  });
}

bool CommitRoom::leave_straight(std::span<const std::uint32_t> vertices,
                                std::span<const VertexMotion> motions) const {
  return std::ranges::none_of(vertices, [&](std::uint32_t v) {
    const std::uint32_t body = body_of_vertex_[v];
    return goes_by_poses(body) ? posed_[body].turns : single_ && !is_single(motions[v]);
  });
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

double most_commit_room(Rounding rounding, const SceneMotion& motion, const CollisionModel& model,
                        PartId part) {
  const LocalTransform& frame = motion.vertices().frame();
  const double size = std::min(origin_size(frame) + frame.to_scene(motion.reach(part)), kMost);
  const double own = share_of(rounding) * size;
  return motion.turns(part) ? std::max(own, posed_room(rounding, motion, model, part).of(size)) : own;
}

}  // namespace warmfront

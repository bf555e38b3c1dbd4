// SPDX-License-Identifier: Apache-2.0
#include "engine/motion/scene_motion.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <utility>

#include "engine/parallel/stoppable_loops.h"
#include "engine/part_way.h"

namespace warmfront {
namespace {

std::array<double, 4> padded(const std::array<double, 3>& x) {
  return {x[0], x[1], x[2], 0.0};
}

}  // namespace

SceneMotion::SceneMotion(const Scene& scene, std::span<const double> positions, StopSignal stop)
    : motion_(positions, stop) {
  find_parts(scene, stop);
}

SceneMotion::Part SceneMotion::stationary_part(const Motion& motion, std::uint32_t first, std::uint32_t end,
                                               BodyKind kind, StopSignal stop) {
  Part part;
  part.first = first;
  part.end = end;
  part.kind = kind;
  motion.measure(first, end, part.range, stop);
  part.reach_at_start = part.range.reach;
  return part;
}

// Takes the parts that the scene has beyond those known.
void SceneMotion::find_parts(const Scene& scene, StopSignal stop) {
  const auto add = [&](std::uint32_t first, std::uint32_t end, BodyKind kind) {
    parts_.push_back(stationary_part(motion_, first, end, kind, stop));
  };
  if (scene.bodies().empty()) add(0, scene.vertex_count(), BodyKind::kDeformable);
  for (std::size_t b = parts_.size(); b < scene.bodies().size(); ++b) {
    const Body& body = scene.bodies()[b];
    add(body.first_vertex, body.first_vertex + body.vertex_count, body.kind);
  }
  lengthen(named_, scene.vertex_count(), std::uint8_t{0}, stop);
  given_.resize(parts_.size());
  take_magnitude();
}

void SceneMotion::renumber(const Renumbering& numbering, std::uint32_t first, StopSignal stop) {
  numbering_ = &numbering;
  motion_.renumber(numbering.given_vertices(), first, stop);
  for (Part& part : parts_) {
    const bool known = part.empty() && std::holds_alternative<AtPose>(part.now);
    if (part.first >= first && part.kind == BodyKind::kRigid && !known) make_rigid(part, stop);
  }
  take_magnitude();
}

void SceneMotion::append(const Scene& scene, std::span<const double> positions, StopSignal stop) {
  motion_.append(positions, stop);
  find_parts(scene, stop);
}

void SceneMotion::truncate(std::uint32_t part_count, std::uint32_t vertex_count) noexcept {
  parts_.erase(parts_.begin() + std::min<std::ptrdiff_t>(part_count, std::ssize(parts_)), parts_.end());
  motion_.truncate(vertex_count);
  named_.resize(std::min<std::size_t>(vertex_count, named_.size()));
  given_.resize(std::min<std::size_t>(part_count, given_.size()));
  take_magnitude();
}

std::shared_ptr<const ReferenceShape> SceneMotion::shape_of(PartId part, StopSignal stop) {
  return std::make_shared<const ReferenceShape>(
      motion_.vertices().subspan(parts_[number_of(part)].first,
                                 parts_[number_of(part)].end - parts_[number_of(part)].first),
      motion_.frame(), stop);
}

void SceneMotion::make_rigid(Part& part, StopSignal stop) {
  AtPose at{shape_of(PartId{static_cast<std::uint32_t>(&part - parts_.data())}, stop), {}};
  part.range.reach = part.reach_at_start = reach_at(part, *at.shape, at.pose);
  part.start = at;
  part.now = std::move(at);
}

void SceneMotion::settle(PartId part, StopSignal stop) {
  settle(parts_[number_of(part)], stop);
}

void SceneMotion::settle(Part& part, StopSignal stop) {
  if (part.placed) return;
  const AtPose& at = std::get<AtPose>(part.now);
  motion_.move_posed(part.first, part.end, at.shape->positions, at.pose, at.pose, std::nullopt, part.range,
                     stop);
  motion_.mark_changed(part.first, part.end, part.range);
  part.placed = true;
}

double SceneMotion::measured_reach(PartId index, StopSignal stop) const {
  RangeMotion range;
  motion_.measure(parts_[number_of(index)].first, parts_[number_of(index)].end, range, stop);
  return range.reach;
}

void SceneMotion::change_kind(PartId index, BodyKind kind, std::shared_ptr<const ReferenceShape> shape,
                              double reach) noexcept {
  Part& part = parts_[number_of(index)];
  if (kind == part.kind && shape == nullptr) return;
  part.kind = kind;
  if (shape != nullptr) {
    part.range.reach = reach_at(part, *shape, {});
    part.start = AtPose{shape, {}};
    part.now = AtPose{std::move(shape), {}};
  } else {
    part.range.reach = reach;
    part.range.loose = false;
    part.start = part.now = AtPositions{};
  }
  part.reach_at_start = part.range.reach;
  part.turned = false;
  take_magnitude();
}

Status SceneMotion::set_poses(std::span<const BodyPose> poses) {
  if (steps_ > 0)
    return Error{ErrorCode::kFailedPrecondition,
                 "poses: bodies are put at poses before the first step only, and " + std::to_string(steps_) +
                     " were made; give the poses in a frame"};
  for (const BodyPose& pose : poses) {
    Part& part = parts_[pose.body];
    for (Placement* placement : {&part.start, &part.now}) std::get<AtPose>(*placement).pose = pose.pose;
    part.range.reach = part.reach_at_start = reach_at(part, *std::get<AtPose>(part.now).shape, pose.pose);
    part.placed = false;
  }
  take_magnitude();
  return {};
}

// Local: what the ball of a part at a pose reaches.
double SceneMotion::reach_at(const Part& part, const ReferenceShape& shape, const Pose& pose) const {
  if (part.empty()) return 0;
  const double reach =
      motion_.reach_of(pose.place(shape.centre.data())) + motion_.frame().to_local(shape.radius);
  return std::isnan(reach) ? std::numeric_limits<double>::infinity() : reach;
}

void SceneMotion::take_magnitude() {
  double reach = 0;
  for (const Part& part : parts_) {
    if (part.kind != BodyKind::kRemoved) reach = std::max({reach, part.reach_at_start, part.range.reach});
  }
  motion_.follow(reach);
}

PartId SceneMotion::part_of(std::uint32_t vertex) const {
  const auto next = std::ranges::upper_bound(parts_, vertex, {}, &Part::first);
  return PartId{static_cast<std::uint32_t>(next - parts_.begin()) - 1};
}

MotionState SceneMotion::state(PartId index) const {
  const Part& part = parts_[number_of(index)];
  if (part.placed) return part.range.any;
  const bool moving = turns(part);
  return static_cast<MotionState>((moving ? kMoving | kChanged : 0) | (part.turned ? kChanged : 0));
}

SceneMotion::Poses SceneMotion::poses(PartId index) const {
  const Part& part = parts_[number_of(index)];
  const auto* at = std::get_if<AtPose>(&part.now);
  return at == nullptr ? Poses{} : Poses{pose_at_start(part), at->pose};
}

SceneMotion::Ball SceneMotion::ball(PartId index) const {
  const Part& part = parts_[number_of(index)];
  const AtPose& at = std::get<AtPose>(part.now);
  const double* centre = at.shape->centre.data();
  return {{padded(pose_at_start(part).place(centre)), padded(at.pose.place(centre))}, at.shape->radius};
}

VertexMotion SceneMotion::vertex(PartId index, std::uint32_t i) const {
  const Part& part = parts_[number_of(index)];
  if (part.placed) return motion_.vertices()[part.first + i];
  const AtPose& at = std::get<AtPose>(part.now);
  const double* x = at.shape->positions.data() + std::size_t{3} * i;
  return {padded(pose_at_start(part).place(x)), padded(at.pose.place(x))};
}

void SceneMotion::points(PartId index, MovingPoints& points) const {
  const Part& part = parts_[number_of(index)];
  if (part.placed) {
    points.take(motion_.vertices().subspan(part.first, part.end - part.first), motion_.frame());
  } else {
    const AtPose& at = std::get<AtPose>(part.now);
    points.take(at.shape->points, pose_at_start(part), at.pose, motion_.frame());
  }
}

std::uint64_t SceneMotion::moved_vertices() const {
  std::uint64_t moved = 0;
  for (std::uint32_t p = 0; p < parts_.size(); ++p) {
    const Part& part = parts_[p];
    const MotionState any = state(PartId{p});
    if ((any & kMoving) == 0) continue;
    if (!part.placed || (part.range.all & kMoving) != 0) {
      moved += part.end - part.first;
    } else {
      for (std::uint32_t v = part.first; v < part.end; ++v) moved += motion_.states()[v] & kMoving;
    }
  }
  return moved;
}

std::vector<double> SceneMotion::positions() const {
  std::vector<double> positions(3 * motion_.vertices().size());
  for (const Part& part : parts_) {
    for (std::uint32_t v = part.first; v < part.end; ++v) {
      const std::size_t given = numbering_ == nullptr ? v : number_of(numbering_->given(NewVertex{v}));
      std::array<double, 3> at{};
      if (part.placed) {
        const VertexMotion& vertex = motion_.vertices()[v];
        std::copy_n((trial_ ? vertex.t0 : vertex.t1).begin(), 3, at.begin());
      } else {
        const AtPose& now = std::get<AtPose>(part.now);
        const Pose pose = trial_ ? pose_at_start(part) : now.pose;
        at = pose.place(now.shape->positions.data() + std::size_t{3} * (v - part.first));
      }
      std::ranges::copy(at, positions.begin() + static_cast<std::ptrdiff_t>(3 * given));
    }
  }
  return positions;
}

std::vector<BodyPose> SceneMotion::poses() const {
  std::vector<BodyPose> poses;
  for (std::uint32_t p = 0; p < part_count(); ++p) {
    const Part& part = parts_[p];
    if (part.rigid()) poses.push_back({p, pose_at_base(part)});
  }
  return poses;
}

Pose SceneMotion::pose_at_base(const Part& part) const {
  const auto* at = std::get_if<AtPose>(trial_ ? &part.start : &part.now);
  return at == nullptr ? Pose{} : at->pose;
}

std::size_t SceneMotion::memory_bytes() const {
  std::size_t bytes = motion_.memory_bytes() + named_.capacity() + given_.capacity();
  for (const Part& part : parts_) {
    bytes +=
        sizeof(part) + part.range.changed.capacity() * sizeof(std::uint32_t) + part.range.begun.capacity();
    const auto* now = std::get_if<AtPose>(&part.now);
    const auto* start = std::get_if<AtPose>(&part.start);
    if (now != nullptr) bytes += now->shape->memory_bytes();
    if (start != nullptr && (now == nullptr || now->shape != start->shape))
      bytes += start->shape->memory_bytes();
  }
  return bytes;
}

}  // namespace warmfront

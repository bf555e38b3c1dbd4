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

std::string at(const char* field, std::size_t index) {
  return std::string(field) + "[" + std::to_string(index) + "]";
}

Status check_any(const Positions& positions, std::uint32_t vertex_count, const std::string& what,
                 StopSignal stop) {
  return std::visit([&](auto values) { return check_positions(values, vertex_count, what, stop); },
                    positions);
}

double coordinate(const Positions& positions, std::size_t index) {
  return std::visit([&](auto values) { return static_cast<double>(values[index]); }, positions);
}

std::array<double, 3> row(const Positions& positions, std::size_t index) {
  return {coordinate(positions, 3 * index), coordinate(positions, 3 * index + 1),
          coordinate(positions, 3 * index + 2)};
}

std::array<double, 4> padded(const std::array<double, 3>& x) {
  return {x[0], x[1], x[2], 0.0};
}

// Bodies of which a frame may name vertices; a static one's positions may be repeated.
Status check_movable(const Body& body, std::uint32_t index, const std::string& where) {
  const std::string name = "body " + std::to_string(index);
  if (body.kind == BodyKind::kRemoved) return invalid_argument(where + ": " + name + " was removed");
  if (body.kind == BodyKind::kStatic)
    return invalid_argument(where + ": " + name +
                            " is static and does not move; leave it out, or change its kind first");
  return {};
}

}  // namespace

SceneMotion::SceneMotion(const Scene& scene, std::span<const double> positions, StopSignal stop)
    : motion_(positions, stop) {
  find_parts(scene, stop);
}

// Takes the parts that the scene has beyond those known.
void SceneMotion::find_parts(const Scene& scene, StopSignal stop) {
  const auto add = [&](std::uint32_t first, std::uint32_t end, BodyKind kind) {
    Part part;
    part.first = first;
    part.end = end;
    part.kind = kind;
    motion_.measure(first, end, part.range, stop);
    part.reach_at_start = part.range.reach;
    parts_.push_back(std::move(part));
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
  motion_.renumber(numbering.vertices(), first, stop);
  for (Part& part : parts_) {
    if (part.first >= first && part.kind == BodyKind::kRigid) make_rigid(part, stop);
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

std::shared_ptr<const ReferenceShape> SceneMotion::shape_of(std::uint32_t part, StopSignal stop) {
  return std::make_shared<const ReferenceShape>(
      motion_.vertices().subspan(parts_[part].first, parts_[part].end - parts_[part].first), motion_.frame(),
      stop);
}

void SceneMotion::make_rigid(Part& part, StopSignal stop) {
  AtPose at{shape_of(static_cast<std::uint32_t>(&part - parts_.data()), stop), {}};
  part.range.reach = part.reach_at_start = reach_at(*at.shape, at.pose);
  part.start = at;
  part.now = std::move(at);
}

void SceneMotion::settle(std::uint32_t part, StopSignal stop) {
  settle(parts_[part], stop);
}

void SceneMotion::settle(Part& part, StopSignal stop) {
  if (part.placed) return;
  const AtPose& at = std::get<AtPose>(part.now);
  motion_.move_posed(part.first, part.end, at.shape->positions, at.pose, at.pose, std::nullopt, part.range,
                     stop);
  motion_.mark_changed(part.first, part.end, part.range);
  part.placed = true;
}

double SceneMotion::measured_reach(std::uint32_t index, StopSignal stop) const {
  RangeMotion range;
  motion_.measure(parts_[index].first, parts_[index].end, range, stop);
  return range.reach;
}

void SceneMotion::change_kind(std::uint32_t index, BodyKind kind, std::shared_ptr<const ReferenceShape> shape,
                              double reach) noexcept {
  Part& part = parts_[index];
  if (kind == part.kind && shape == nullptr) return;
  part.kind = kind;
  if (shape != nullptr) {
    part.range.reach = reach_at(*shape, {});
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
    part.range.reach = part.reach_at_start = reach_at(*std::get<AtPose>(part.now).shape, pose.pose);
    part.placed = false;
  }
  take_magnitude();
  return {};
}

void SceneMotion::hold(double local_length) {
  held_ = std::max(held_, local_length);
  take_magnitude();
}

// Local: what the ball of a part at a pose reaches.
double SceneMotion::reach_at(const ReferenceShape& shape, const Pose& pose) const {
  const double reach =
      motion_.reach_of(pose.place(shape.centre.data())) + motion_.frame().to_local(shape.radius);
  return std::isnan(reach) ? std::numeric_limits<double>::infinity() : reach;
}

void SceneMotion::take_magnitude() {
  double reach = held_;
  for (const Part& part : parts_) {
    if (part.kind != BodyKind::kRemoved) reach = std::max({reach, part.reach_at_start, part.range.reach});
  }
  motion_.follow(reach);
}

std::uint32_t SceneMotion::part_of(std::uint32_t vertex) const {
  const auto next = std::ranges::upper_bound(parts_, vertex, {}, &Part::first);
  return static_cast<std::uint32_t>(next - parts_.begin()) - 1;
}

Status SceneMotion::check(const Scene& scene, const Frame& frame, StopSignal stop, PoseCheck poses) {
  if (frame.positions) {
    if (!frame.bodies.empty() || !frame.poses.empty() || !frame.vertices.empty())
      return invalid_argument(
          "positions: the frame gives all vertices and also parts; give only one of them");
    return check_whole(scene, *frame.positions, stop);
  }
  // Messages of errors may find no memory.
  struct Marks {
    ~Marks() { motion.clear_marks(frame); }
    SceneMotion& motion;
    const Frame& frame;
  } const marks{*this, frame};
  return check_parts(scene, frame, stop, poses);
}

void SceneMotion::clear_marks(const Frame& frame) noexcept {
  for (const std::uint32_t v : frame.vertices) {
    if (v < named_.size()) named_[v] = 0;
  }
  const auto clear_part = [this](std::uint32_t part) {
    if (part < parts_.size() && parts_[part].first < named_.size()) named_[parts_[part].first] = 0;
  };
  for (const BodyPositions& body : frame.bodies) clear_part(body.body);
  for (const BodyPose& pose : frame.poses) clear_part(pose.body);
}

Status SceneMotion::check_whole(const Scene& scene, const Positions& positions, StopSignal stop) const {
  PacedStop paced(stop);
  if (Status status = check_any(positions, scene.vertex_count(), "positions", stop); !status) return status;
  for (std::size_t b = 0; b < scene.bodies().size(); ++b) {
    const Body& body = scene.bodies()[b];
    if (body.kind != BodyKind::kStatic) continue;
    for (std::uint32_t v = body.first_vertex; v < body.first_vertex + body.vertex_count; ++v) {
      paced.check();
      const auto& now = motion_.vertices()[new_vertex(v)].t1;
      for (int axis = 0; axis < 3; ++axis) {
        if (coordinate(positions, std::size_t{3} * v + axis) != now[axis])
          return invalid_argument(at("positions", v) + "." + "xyz"[axis] + ": moves, but body " +
                                  std::to_string(b) + " is static; make it rigid or deformable");
      }
    }
  }
  return {};
}

Status SceneMotion::check_parts(const Scene& scene, const Frame& frame, StopSignal stop, PoseCheck poses) {
  PacedStop paced(stop);
  const auto check_body = [&](std::uint32_t index, const std::string& where) -> Status {
    if (scene.bodies().empty())
      return invalid_argument(where +
                              ": the scene declares no bodies; give all positions, or single vertices");
    if (index >= scene.bodies().size())
      return invalid_argument(where + ": body " + std::to_string(index) + " is not in [0, " +
                              std::to_string(scene.bodies().size()) + ")");
    if (Status status = check_movable(scene.bodies()[index], index, where); !status) return status;
    // A body's first vertex stands for it, as 2.
    if (named_[parts_[index].first] == 2)
      return invalid_argument(where + ": body " + std::to_string(index) + " is given twice");
    named_[parts_[index].first] = 2;
    return {};
  };
  for (std::size_t i = 0; i < frame.bodies.size(); ++i) {
    paced.check();
    const BodyPositions& body = frame.bodies[i];
    const std::string where = at("bodies", i);
    if (Status status = check_body(body.body, where); !status) return status;
    if (Status status =
            check_any(body.positions, scene.bodies()[body.body].vertex_count, where + ".positions", stop);
        !status)
      return status;
  }
  for (std::size_t i = 0; i < frame.poses.size(); ++i) {
    paced.check();
    const std::string where = at("poses", i);
    const std::uint32_t index = frame.poses[i].body;
    if (Status status = check_body(index, where); !status) return status;
    if (scene.bodies()[index].kind != BodyKind::kRigid)
      return invalid_argument(where + ": body " + std::to_string(index) +
                              " is not rigid; give its positions, or make it rigid first");
    if (Status status = check_pose(frame.poses[i].pose, where + ".pose", poses); !status) return status;
  }
  for (std::size_t i = 0; i < frame.vertices.size(); ++i) {
    paced.check();
    const std::uint32_t v = frame.vertices[i];
    const std::string where = at("vertices", i);
    if (v >= scene.vertex_count())
      return invalid_argument(where + ": vertex " + std::to_string(v) + " is not in [0, " +
                              std::to_string(scene.vertex_count()) + ")");
    const std::uint32_t part = part_of(v);
    if (!scene.bodies().empty()) {
      const Body& body = scene.bodies()[part];
      if (Status status = check_movable(body, part, where); !status) return status;
      if (body.kind == BodyKind::kRigid)
        return invalid_argument(where + ": vertex " + std::to_string(v) + " is of the rigid body " +
                                std::to_string(part) + "; give its pose, or all of its positions");
      if (named_[parts_[part].first] == 2)
        return invalid_argument(where + ": vertex " + std::to_string(v) + " is of body " +
                                std::to_string(part) + ", which the frame gives as a whole");
    }
    if (named_[v] != 0) return invalid_argument(where + ": vertex " + std::to_string(v) + " is named twice");
    named_[v] = 1;
  }
  return check_any(frame.vertex_positions, static_cast<std::uint32_t>(frame.vertices.size()),
                   "vertex_positions", stop);
}

void SceneMotion::move_part(Part& part, const Positions& positions, std::uint32_t first_row,
                            StopSignal stop) {
  settle(part, stop);
  part.written = true;
  std::visit(
      [&](auto values) {
        motion_.move_all(part.first, part.end, from_, values, numbering_->vertices(), first_row, part.range,
                         stop);
      },
      positions);
  if (part.rigid()) part.now = AtPositions{};
}

namespace {

enum Given : std::uint8_t { kNotGiven, kByPositions, kByPose };

// A copy only where it is another one: thousands of bodies may be stationary.
void copy(const Placement& from, Placement& to) {
  const auto* x = std::get_if<AtPose>(&from);
  auto* y = std::get_if<AtPose>(&to);
  if (x != nullptr && y != nullptr && x->shape == y->shape) {
    y->pose = x->pose;
  } else if (x != nullptr || y != nullptr) {
    to = from;
  }
}

/// A local reach that was measured once too often too large is measured again every so many steps.
constexpr std::uint64_t kMeasureSteps = 16;

}  // namespace

// Puts a part back to where the motion begins.
void SceneMotion::begin_part(Part& part) {
  part.turned = part.rigid() && (turns(part) || part.shortened);
  part.shortened = false;
  part.follows = part.placed;
  if (from_ == From::kEnd) {
    if (part.rigid()) copy(part.now, part.start);
    part.reach_at_start = part.range.reach;
    return;
  }
  if (part.rigid()) copy(part.start, part.now);
  part.range.reach = part.reach_at_start;
  if (!part.placed && std::holds_alternative<AtPositions>(part.now)) {
    // It was given a pose, and nobody asked for its vertices.
    motion_.mark_changed(part.first, part.end, part.range);
    part.placed = true;
  }
}

void SceneMotion::begin(const Frame& frame, StopSignal stop) {
  PacedStop paced(stop);
  from_ = trial_ ? From::kStart : From::kEnd;
  magnitude_before_ = motion_.magnitude();
  ++begun_;
  std::ranges::fill(given_, frame.positions ? kByPositions : kNotGiven);
  for (const BodyPositions& body : frame.bodies) given_[body.body] = kByPositions;
  for (const BodyPose& pose : frame.poses) given_[pose.body] = kByPose;
  for (std::size_t p = 0; p < parts_.size(); ++p) {
    paced.check();
    Part& part = parts_[p];
    part.written = false;
    part.begun_in = begun_;
    begin_part(part);
    // Static and removed bodies were checked to stay, or are of no interest.
    const bool fixed = part.kind == BodyKind::kStatic || part.kind == BodyKind::kRemoved;
    if (given_[p] == kByPositions && frame.positions && !fixed) {
      move_part(part, *frame.positions, 0, stop);
    } else if (given_[p] != kByPositions || fixed) {
      if (part.placed) motion_.rest(part.first, part.end, from_, part.range, stop);
      part.written = true;
    }
  }
  for (const BodyPositions& body : frame.bodies)
    move_part(parts_[body.body], body.positions, parts_[body.body].first, stop);
  for (const BodyPose& pose : frame.poses) {
    paced.check();
    Part& part = parts_[pose.body];
    auto* at = std::get_if<AtPose>(&part.now);
    if (at == nullptr)
      at = &part.now.emplace<AtPose>(AtPose{shape_of(pose.body, stop), {}});  // its positions were given last
    at->pose = pose.pose;
    part.range.reach = reach_at(*at->shape, at->pose);
  }
  for (Part& part : parts_) {
    // What moves by a pose, or did so in the last step, is not where its vertices are.
    if (part.rigid() && std::holds_alternative<AtPose>(part.now) && (part.turned || turns(part)))
      part.placed = false;
  }
  for (std::size_t i = 0; i < frame.vertices.size(); ++i) {
    paced.check();
    const std::uint32_t v = frame.vertices[i];
    motion_.move_one(new_vertex(v), row(frame.vertex_positions, i), parts_[part_of(v)].range);
  }
  if (steps_ % kMeasureSteps == 0) {
    for (Part& part : parts_) {
      if (part.range.loose) motion_.measure(part.first, part.end, part.range, stop);
    }
  }
  take_magnitude();
}

void SceneMotion::place(std::uint32_t index, StopSignal stop) {
  Part& part = parts_[index];
  const AtPose& to = std::get<AtPose>(part.now);
  motion_.move_posed(part.first, part.end, to.shape->positions, pose_at_start(part), to.pose,
                     part.follows ? std::optional(from_) : std::nullopt, part.range, stop);
  part.placed = true;
}

void SceneMotion::roll_back() noexcept {
  for (Part& part : parts_) {
    const bool begun = part.begun_in == begun_;
    if (!begun && from_ == From::kEnd) continue;  // else it is where the trial before put it
    if (std::holds_alternative<AtPose>(part.start)) {
      part.placed = false;  // the vertices are made of the pose again when they are needed
    } else {
      if (!part.placed) motion_.mark_changed(part.first, part.end, part.range);
      if (part.written || from_ == From::kStart) motion_.undo(part.first, part.end, from_, part.range);
      part.placed = true;
    }
    copy(part.start, part.now);
    part.range.reach = part.reach_at_start;
  }
  motion_.restore_magnitude(magnitude_before_);
  trial_ = false;
}

void SceneMotion::commit_trial(double fraction, bool single) noexcept {
  trial_ = false;
  if (fraction > 0) ++steps_;
  if (fraction == 1) return;
  if (fraction == 0) {
    for (Part& part : parts_) part.shortened = part.rigid() && (turns(part) || part.range.any != 0);
    return roll_back();
  }
  for (Part& part : parts_) {
    part.range.reach = std::max(part.range.reach, part.reach_at_start);
    if (turns(part)) {
      Pose& pose = std::get<AtPose>(part.now).pose;
      pose = part_way(pose_at_start(part), pose, fraction, single);
      part.shortened = true;
      part.placed = false;
    } else if (part.placed && (part.range.any & kMoving) != 0) {
      motion_.shorten(part.first, part.end, fraction, single, part.range);
    }
  }
}

// Is the part at a pose that is another one than at t = 0?
bool SceneMotion::turns(const Part& part) {
  const auto* at = std::get_if<AtPose>(&part.now);
  return at != nullptr && !(at->pose == pose_at_start(part));
}

// Of a part that moves by poses: one that was at positions begins at the identity of the shape made of these.
Pose SceneMotion::pose_at_start(const Part& part) {
  const auto* at = std::get_if<AtPose>(&part.start);
  return at == nullptr ? Pose{} : at->pose;
}

MotionState SceneMotion::state(std::uint32_t index) const {
  const Part& part = parts_[index];
  if (part.placed) return part.range.any;
  const bool moving = turns(part);
  return static_cast<MotionState>((moving ? kMoving | kChanged : 0) | (part.turned ? kChanged : 0));
}

SceneMotion::Ball SceneMotion::ball(std::uint32_t index) const {
  const Part& part = parts_[index];
  const AtPose& at = std::get<AtPose>(part.now);
  const double* centre = at.shape->centre.data();
  return {{padded(pose_at_start(part).place(centre)), padded(at.pose.place(centre))}, at.shape->radius};
}

VertexMotion SceneMotion::vertex(std::uint32_t index, std::uint32_t i) const {
  const Part& part = parts_[index];
  if (part.placed) return motion_.vertices()[part.first + i];
  const AtPose& at = std::get<AtPose>(part.now);
  const double* x = at.shape->positions.data() + std::size_t{3} * i;
  return {padded(pose_at_start(part).place(x)), padded(at.pose.place(x))};
}

void SceneMotion::points(std::uint32_t index, MovingPoints& points) const {
  const Part& part = parts_[index];
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
    const MotionState any = state(p);
    if ((any & kMoving) == 0) continue;
    if (unplaced(p) || (part.range.all & kMoving) != 0) {
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
      const std::size_t given = numbering_ == nullptr ? v : numbering_->vertices()[v];
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

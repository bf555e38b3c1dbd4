// SPDX-License-Identifier: Apache-2.0
#include "engine/motion/scene_motion.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <utility>

namespace warmfront {
namespace {

std::string at(const char* field, std::size_t index) {
  return std::string(field) + "[" + std::to_string(index) + "]";
}

Status check_any(const Positions& positions, std::uint32_t vertex_count, const std::string& what) {
  return std::visit([&](auto values) { return check_positions(values, vertex_count, what); }, positions);
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

SceneMotion::SceneMotion(const Scene& scene, std::span<const double> positions) : motion_(positions) {
  find_parts(scene);
}

// Takes the parts that the scene has beyond those known.
void SceneMotion::find_parts(const Scene& scene) {
  if (scene.bodies().empty()) {
    Part part;
    part.end = scene.vertex_count();
    parts_.push_back(std::move(part));
  }
  for (std::size_t b = parts_.size(); b < scene.bodies().size(); ++b) {
    const Body& body = scene.bodies()[b];
    Part part;
    part.first = body.first_vertex;
    part.end = body.first_vertex + body.vertex_count;
    part.kind = body.kind;
    parts_.push_back(std::move(part));
  }
  named_.resize(scene.vertex_count(), 0);
}

void SceneMotion::renumber(const Renumbering& numbering, std::uint32_t first) {
  numbering_ = &numbering;
  motion_.renumber(numbering.vertices(), first);
  for (Part& part : parts_) {
    if (part.first >= first && part.kind == BodyKind::kRigid) make_rigid(part);
  }
}

void SceneMotion::append(const Scene& scene, std::span<const double> positions) {
  motion_.append(positions);
  find_parts(scene);
}

// No point of (n, 3) is farther from the centre: the root of a sum of squares, of offsets that are scaled to
// be near 1 first, so that no square leaves double's range. Places on a grid of denormal numbers are off by
// three of its steps a coordinate at most.
double radius_about(std::span<const double> points, const std::array<double, 3>& centre) {
  double largest = 0;
  for (std::size_t i = 0; i < points.size(); ++i)
    largest = std::max(largest, std::fabs(points[i] - centre[i % 3]));
  int exponent = 0;
  std::frexp(largest, &exponent);
  double square = 0;
  for (std::size_t i = 0; i < points.size(); i += 3) {
    double distance = 0;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double offset = std::ldexp(points[i + axis] - centre[axis], -exponent);
      distance += offset * offset;
    }
    square = std::max(square, distance);
  }
  return std::ldexp(std::sqrt(square) * (1 + 0x1p-50), exponent) + 0x1p-1071;
}

// Where the part is, is its rest shape.
void SceneMotion::make_rigid(Part& part) {
  part.rest.resize(std::size_t{3} * (part.end - part.first));
  std::array<double, 3> lo{};
  std::array<double, 3> hi{};
  for (std::uint32_t v = part.first; v < part.end; ++v) {
    for (int axis = 0; axis < 3; ++axis) {
      const double x = motion_.vertices()[v].t1[axis];
      part.rest[std::size_t{3} * (v - part.first) + axis] = x;
      lo[axis] = v == part.first ? x : std::min(lo[axis], x);
      hi[axis] = v == part.first ? x : std::max(hi[axis], x);
    }
  }
  for (int axis = 0; axis < 3; ++axis) part.centre[axis] = lo[axis] / 2 + hi[axis] / 2;
  const bool small = part.end > part.first && part.end - part.first <= MovingPoints::kMost;
  part.points = small ? RestPoints(part.rest, part.centre, motion_.frame()) : RestPoints();
  // A pose may be off a rotation by kPoseTolerance in each of nine products: far less than this.
  part.radius = radius_about(part.rest, part.centre) * (1 + 16 * kPoseTolerance);
  part.pose = part.last_pose = {};
  part.posed = true;
  part.placed = true;
}

void SceneMotion::settle(Part& part) {
  if (!part.posed) return;
  if (!part.placed) {
    motion_.move_posed(part.first, part.end, part.rest, part.pose, part.pose, false, part.range);
    motion_.undo(part.first, part.end, part.range);  // for the step to come they are news
    part.placed = true;
  }
  part.posed = false;
}

void SceneMotion::change_kind(const Scene& scene, std::uint32_t body) {
  Part& part = parts_[body];
  const BodyKind kind = scene.bodies()[body].kind;
  if (kind == part.kind) return;
  settle(part);
  part.kind = kind;
  part.rest.clear();
  part.points = {};
  if (kind == BodyKind::kRigid) make_rigid(part);
}

void SceneMotion::set_poses(std::span<const BodyPose> poses) {
  for (const BodyPose& pose : poses) {
    Part& part = parts_[pose.body];
    part.pose = part.last_pose = pose.pose;
    part.placed = false;
  }
}

std::uint32_t SceneMotion::part_of(std::uint32_t vertex) const {
  const auto next = std::ranges::upper_bound(parts_, vertex, {}, &Part::first);
  return static_cast<std::uint32_t>(next - parts_.begin()) - 1;
}

Status SceneMotion::check(const Scene& scene, const Frame& frame) {
  if (frame.positions) {
    if (!frame.bodies.empty() || !frame.poses.empty() || !frame.vertices.empty())
      return invalid_argument(
          "positions: the frame gives all vertices, and bodies, poses or single vertices besides; give "
          "either");
    return check_whole(scene, *frame.positions);
  }
  const Status status = check_parts(scene, frame);
  for (const std::uint32_t v : frame.vertices) {
    if (v < named_.size()) named_[v] = 0;
  }
  for (const BodyPositions& body : frame.bodies) {
    if (body.body < parts_.size()) named_[parts_[body.body].first] = 0;
  }
  for (const BodyPose& pose : frame.poses) {
    if (pose.body < parts_.size()) named_[parts_[pose.body].first] = 0;
  }
  return status;
}

Status SceneMotion::check_whole(const Scene& scene, const Positions& positions) const {
  if (Status status = check_any(positions, scene.vertex_count(), "positions"); !status) return status;
  for (std::size_t b = 0; b < scene.bodies().size(); ++b) {
    const Body& body = scene.bodies()[b];
    if (body.kind != BodyKind::kStatic) continue;
    for (std::uint32_t v = body.first_vertex; v < body.first_vertex + body.vertex_count; ++v) {
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

Status SceneMotion::check_parts(const Scene& scene, const Frame& frame) {
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
    const BodyPositions& body = frame.bodies[i];
    const std::string where = at("bodies", i);
    if (Status status = check_body(body.body, where); !status) return status;
    if (Status status =
            check_any(body.positions, scene.bodies()[body.body].vertex_count, where + ".positions");
        !status)
      return status;
  }
  for (std::size_t i = 0; i < frame.poses.size(); ++i) {
    const std::string where = at("poses", i);
    const std::uint32_t index = frame.poses[i].body;
    if (Status status = check_body(index, where); !status) return status;
    if (scene.bodies()[index].kind != BodyKind::kRigid)
      return invalid_argument(where + ": body " + std::to_string(index) +
                              " is not rigid; give its positions, or make it rigid first");
    if (Status status = check_pose(frame.poses[i].pose, where + ".pose"); !status) return status;
  }
  for (std::size_t i = 0; i < frame.vertices.size(); ++i) {
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
                   "vertex_positions");
}

void SceneMotion::move_part(Part& part, const Positions& positions, std::uint32_t first_row) {
  settle(part);
  std::visit(
      [&](auto values) {
        motion_.move_all(part.first, part.end, values, numbering_->vertices(), first_row, part.range);
      },
      positions);
}

void SceneMotion::begin(const Frame& frame) {
  std::vector<std::uint8_t> given(parts_.size(), frame.positions ? 1 : 0);
  for (const BodyPositions& body : frame.bodies) given[body.body] = 1;
  for (const BodyPose& pose : frame.poses) given[pose.body] = 2;
  for (std::size_t p = 0; p < parts_.size(); ++p) {
    Part& part = parts_[p];
    part.moved = part.posed && !(part.pose == part.last_pose);
    part.last_pose = part.pose;
    part.follows = part.placed;
    // Static and removed bodies were checked to stay, or are of no interest.
    const bool fixed = part.kind == BodyKind::kStatic || part.kind == BodyKind::kRemoved;
    if (given[p] == 1 && frame.positions && !fixed) {
      move_part(part, *frame.positions, 0);
    } else if (given[p] != 1 || fixed) {
      if (part.placed) motion_.rest(part.first, part.end, part.range);
    }
  }
  for (const BodyPositions& body : frame.bodies) {
    Part& part = parts_[body.body];
    move_part(part, body.positions, part.first);
  }
  for (const BodyPose& pose : frame.poses) {
    Part& part = parts_[pose.body];
    if (!part.posed) make_rigid(part);  // its positions were given last
    part.pose = pose.pose;
  }
  for (Part& part : parts_) {
    // What moves by a pose, or did so in the last step, is not where its vertices are.
    if (part.posed && (part.moved || !(part.pose == part.last_pose))) part.placed = false;
  }
  for (std::size_t i = 0; i < frame.vertices.size(); ++i) {
    const std::uint32_t v = frame.vertices[i];
    motion_.move_one(new_vertex(v), row(frame.vertex_positions, i), parts_[part_of(v)].range);
  }
  for (const Part& part : parts_) {
    if (!part.posed || part.placed) continue;
    // What its ball's bounds are made with.
    const LocalFrame& local = motion_.frame();
    for (const Pose* pose : {&part.last_pose, &part.pose}) {
      const auto centre = pose->place(part.centre.data());
      for (int axis = 0; axis < 3; ++axis) {
        const double x = std::fabs(local.to_local(centre[axis]) - local.to_local(local.origin[axis]));
        const double reach = x + local.to_local(part.radius);
        motion_.hold(std::isnan(reach) ? std::numeric_limits<double>::infinity() : reach);
      }
    }
  }
}

void SceneMotion::place(std::uint32_t index) {
  Part& part = parts_[index];
  motion_.move_posed(part.first, part.end, part.rest, part.last_pose, part.pose, part.follows, part.range);
  part.placed = true;
}

void SceneMotion::undo() {
  for (Part& part : parts_) {
    if (part.posed) {
      // Its vertices are placed anew when they are needed.
      if (!(part.pose == part.last_pose) || part.moved) part.placed = false;
      part.pose = part.last_pose;
      if (part.placed) motion_.undo(part.first, part.end, part.range);
    } else {
      motion_.undo(part.first, part.end, part.range);
    }
  }
}

MotionState SceneMotion::state(std::uint32_t index) const {
  const Part& part = parts_[index];
  if (!part.posed || part.placed) return part.range.any;
  const bool moving = !(part.pose == part.last_pose);
  return static_cast<MotionState>((moving ? kMoving | kChanged : 0) | (part.moved ? kChanged : 0));
}

SceneMotion::Ball SceneMotion::ball(std::uint32_t index) const {
  const Part& part = parts_[index];
  return {{padded(part.last_pose.place(part.centre.data())), padded(part.pose.place(part.centre.data()))},
          part.radius};
}

VertexMotion SceneMotion::vertex(std::uint32_t index, std::uint32_t i) const {
  const Part& part = parts_[index];
  if (!unplaced(index)) return motion_.vertices()[part.first + i];
  const double* rest = part.rest.data() + std::size_t{3} * i;
  return {padded(part.last_pose.place(rest)), padded(part.pose.place(rest))};
}

void SceneMotion::points(std::uint32_t index, MovingPoints& points) const {
  const Part& part = parts_[index];
  if (unplaced(index)) {
    points.take(part.points, part.last_pose, part.pose, motion_.frame());
  } else {
    points.take(motion_.vertices().subspan(part.first, part.end - part.first), motion_.frame());
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
      const auto& x = motion_.vertices()[v].t1;
      const std::array<double, 3> at =
          part.posed && !part.placed ? part.pose.place(part.rest.data() + std::size_t{3} * (v - part.first))
                                     : std::array{x[0], x[1], x[2]};
      std::ranges::copy(at, positions.begin() + static_cast<std::ptrdiff_t>(3 * given));
    }
  }
  return positions;
}

std::size_t SceneMotion::memory_bytes() const {
  std::size_t bytes = motion_.memory_bytes() + named_.capacity();
  for (const Part& part : parts_)
    bytes += sizeof(part) + part.rest.capacity() * sizeof(double) +
             part.points.lane.capacity() * sizeof(float) +
             part.range.changed.capacity() * sizeof(std::uint32_t);
  return bytes;
}

}  // namespace warmfront

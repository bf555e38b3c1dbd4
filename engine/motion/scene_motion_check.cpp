// SPDX-License-Identifier: Apache-2.0
// What a frame must fulfil before anything is written.
#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "engine/digits.h"
#include "engine/motion/check_positions.h"
#include "engine/motion/position_rows.h"
#include "engine/motion/scene_motion.h"
#include "engine/scene/description_checks.h"

namespace warmfront {
namespace {

/// Of SceneMotion::given_, between the bodies of a frame that is being checked.
constexpr std::uint8_t kNamed = 0x80;

std::string at(const char* field, std::size_t index) {
  return std::string(field) + "[" + std::to_string(index) + "]";
}

Status check_any(const Positions& positions, std::uint32_t vertex_count, const std::string& what,
                 StopSignal stop, Workers* workers) {
  return std::visit([&](auto values) { return check_positions(values, vertex_count, what, stop, workers); },
                    positions);
}

// Bodies of which a frame may name vertices; a static one's positions may be repeated.
Status check_movable(const Body& body, std::uint32_t index, const std::string& where) {
  const auto name = [&] { return in_words(index, body); };
  if (body.kind == BodyKind::kRemoved) return invalid_argument(where + ": " + name() + " was removed");
  if (body.kind == BodyKind::kStatic)
    return invalid_argument(where + ": " + name() +
                            " is static and does not move; leave it out, or change its kind first");
  return {};
}

}  // namespace

Status SceneMotion::check(const Scene& scene, const Frame& frame, StopSignal stop, PoseCheck poses,
                          Workers* workers) {
  if (frame.positions) {
    if (!frame.bodies.empty() || !frame.poses.empty() || !frame.vertices.empty())
      return invalid_argument(
          "positions: the frame gives all vertices and also parts; give only one of them");
    return check_whole(scene, *frame.positions, stop, workers);
  }
  // Messages of errors may find no memory.
  struct Marks {
    ~Marks() { motion.clear_marks(frame); }
    SceneMotion& motion;
    const Frame& frame;
  } const marks{*this, frame};
  return check_parts(scene, frame, stop, poses, workers);
}

void SceneMotion::clear_marks(const Frame& frame) noexcept {
  for (const std::uint32_t v : frame.vertices) {
    if (v < named_.size()) named_[v] = 0;
  }
  const auto clear_part = [this](PartId part) {
    if (number_of(part) >= parts_.size()) return;
    if (parts_[number_of(part)].empty())
      given_[number_of(part)] &= static_cast<std::uint8_t>(~kNamed);
    else
      named_[parts_[number_of(part)].first] = 0;
  };
  for (const BodyPositions& body : frame.bodies) clear_part(part_of_body(body.body));
  for (const BodyPose& pose : frame.poses) clear_part(part_of_body(pose.body));
}

Status SceneMotion::check_whole(const Scene& scene, const Positions& positions, StopSignal stop,
                                Workers* workers) const {
  PacedStop paced(stop);
  if (Status status = check_any(positions, scene.vertex_count(), "positions", stop, workers); !status)
    return status;
  for (std::size_t b = 0; b < scene.bodies().size(); ++b) {
    const Body& body = scene.bodies()[b];
    if (body.kind != BodyKind::kStatic) continue;
    for (std::uint32_t v = body.first_vertex; v < body.first_vertex + body.vertex_count; ++v) {
      paced.check();
      const auto& now = motion_.vertices()[new_vertex(GivenVertex{v})].t1;
      for (int axis = 0; axis < 3; ++axis) {
        if (coordinate(positions, std::size_t{3} * v + axis) != now[axis])
          return invalid_argument(
              at("positions", v) + "." + "xyz"[axis] + ": moves, but " + in_words(b, body) +
              " is static; make it rigid or deformable, or give its coordinates to the bit: "
              "this one is " +
              digits_of(coordinate(positions, std::size_t{3} * v + axis)) + ", and was " +
              digits_of(now[axis]));
      }
    }
  }
  return {};
}

// Of what is far from there by its size that is known without looking at vertices.
bool SceneMotion::is_finite_at(const Pose& pose, const Part& part, const Body& body, StopSignal stop) const {
  const auto is_finite = [&pose](const double* x) {
    return std::ranges::all_of(pose.place(x), [](double y) { return std::isfinite(y); });
  };
  if (body.half_space) return is_finite(body.half_space->point.data());
  constexpr double kFar = 0x1p1000;
  const auto largest = [](const double* x, std::size_t stride) {
    return std::max({std::fabs(x[0]), std::fabs(x[stride]), std::fabs(x[2 * stride])});
  };
  const auto* at = std::get_if<AtPose>(trial_ ? &part.start : &part.now);
  const LocalTransform& frame = motion_.frame();
  const double reach = trial_ ? part.reach_at_start : part.range.reach;
  const double size = at != nullptr ? largest(at->shape->centre.data(), 1) + at->shape->radius
                                    : largest(frame.origin.data(), 1) + frame.to_scene(reach);
  if (size < kFar && largest(pose.matrix.data() + 3, 4) < kFar) return true;
  PacedStop paced(stop);
  for (std::uint32_t v = part.first; v < part.end; ++v) {
    paced.check();
    if (!is_finite(at != nullptr
                       ? at->shape->positions.data() + std::size_t{3} * (v - part.first)
                       : (motion_.vertices()[v].*(trial_ ? &VertexMotion::t0 : &VertexMotion::t1)).data()))
      return false;
  }
  return true;
}

Status SceneMotion::check_parts(const Scene& scene, const Frame& frame, StopSignal stop, PoseCheck poses,
                                Workers* workers) {
  PacedStop paced(stop);
  const auto check_body = [&](std::uint32_t index, const std::string& where) -> Status {
    if (scene.bodies().empty())
      return invalid_argument(where +
                              ": the scene declares no bodies; give all positions, or single vertices");
    if (Status status = check_body_number(where, index, scene.bodies().size()); !status) return status;
    if (Status status = check_movable(scene.bodies()[index], index, where); !status) return status;
    // A body's first vertex stands for it, as 2; for a half-space, which has none, a bit of its own.
    const bool empty = parts_[index].empty();
    const bool twice = empty ? (given_[index] & kNamed) != 0 : named_[parts_[index].first] == 2;
    if (twice)
      return invalid_argument(where + ": " + in_words(index, scene.bodies()[index]) + " is given twice");
    if (empty)
      given_[index] |= kNamed;
    else
      named_[parts_[index].first] = 2;
    return {};
  };
  for (std::size_t i = 0; i < frame.bodies.size(); ++i) {
    paced.check();
    const BodyPositions& body = frame.bodies[i];
    const std::string where = at("bodies", i);
    if (Status status = check_body(body.body, where); !status) return status;
    if (parts_[body.body].empty())
      return invalid_argument(where + ": " + in_words(body.body, scene.bodies()[body.body]) +
                              " is a half-space, which has no positions; it moves by poses: give its pose");
    if (Status status =
            check_any(body.positions, scene.bodies()[body.body].vertex_count, "positions", stop, workers);
        !status)
      return of_body(where, body.body, scene.bodies()[body.body], status.error());
  }
  for (std::size_t i = 0; i < frame.poses.size(); ++i) {
    paced.check();
    const std::string where = at("poses", i);
    const std::uint32_t index = frame.poses[i].body;
    if (Status status = check_body(index, where); !status) return status;
    if (scene.bodies()[index].kind != BodyKind::kRigid)
      return invalid_argument(where + ": " + in_words(index, scene.bodies()[index]) +
                              " is not rigid; give its positions, or make it rigid first");
    // What a commit left part of the way between two poses may stay there.
    if (frame.poses[i].pose == pose_at_base(parts_[index])) continue;
    if (Status status = check_pose(frame.poses[i].pose, "pose", poses); !status)
      return of_body(where, index, scene.bodies()[index], status.error());
    if (!is_finite_at(frame.poses[i].pose, parts_[index], scene.bodies()[index], stop))
      return of_body(where, index, scene.bodies()[index],
                     invalid_argument("pose: puts something beyond the largest number, " +
                                      digits_of(std::numeric_limits<double>::max()) + "; leave it nearer"));
  }
  for (std::size_t i = 0; i < frame.vertices.size(); ++i) {
    paced.check();
    const std::uint32_t v = frame.vertices[i];
    const std::string where = at("vertices", i);
    if (v >= scene.vertex_count())
      return invalid_argument(where + ": vertex " + std::to_string(v) + " is not in [0, " +
                              std::to_string(scene.vertex_count()) + ")");
    if (!scene.bodies().empty()) {
      const PartId part = part_of(v);
      const std::uint32_t index = body_of_part(part);
      const Body& body = scene.bodies()[index];
      if (Status status = check_movable(body, index, where); !status) return status;
      if (body.kind == BodyKind::kRigid)
        return invalid_argument(where + ": vertex " + std::to_string(v) + " is of the rigid " +
                                in_words(index, body) + "; give its pose, or all of its positions");
      if (named_[parts_[number_of(part)].first] == 2)
        return invalid_argument(where + ": vertex " + std::to_string(v) + " is of " + in_words(index, body) +
                                ", which the frame gives as a whole");
    }
    if (named_[v] != 0) return invalid_argument(where + ": vertex " + std::to_string(v) + " is named twice");
    named_[v] = 1;
  }
  return check_any(frame.vertex_positions, static_cast<std::uint32_t>(frame.vertices.size()),
                   "vertex_positions", stop, workers);
}

}  // namespace warmfront

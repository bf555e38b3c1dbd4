// SPDX-License-Identifier: Apache-2.0
// A scene's motion, part by part: what a frame says, checked and carried out. Written between steps by one
// thread, read by all during a step.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "engine/frame.h"
#include "engine/motion/motion.h"
#include "engine/motion/moving_points.h"
#include "engine/result.h"
#include "engine/scene/renumbering.h"
#include "engine/scene/scene.h"

namespace warmfront {

class SceneMotion {
 public:
  /// At rest, in the numbers first given; begin() needs renumber() first.
  SceneMotion(const Scene& scene, std::span<const double> positions);

  /// Takes new numbers for vertices from `first` on. The numbering outlives this.
  void renumber(const Renumbering& numbering, std::uint32_t first = 0);
  /// Appends the scene's last body, at rest.
  void append(const Scene& scene, std::span<const double> positions);
  /// The body's kind is another one now; where it is becomes its rest shape.
  void change_kind(const Scene& scene, std::uint32_t body);

  /// Puts parts at checked poses, at rest, before the first step.
  void set_poses(std::span<const BodyPose> poses);

  /// kInvalidArgument, naming the field and the first offender, for a frame that does not fit the scene:
  /// wrong lengths, coordinates that are not finite, poses that are not rigid or not of a rigid body, indices
  /// out of range or named twice, static or removed bodies that move.
  Status check(const Scene& scene, const Frame& frame);

  /// Begins the step that a checked frame describes. Parts that move by poses only know these yet: see
  /// place(). Parallel inside Workers::run().
  void begin(const Frame& frame);
  /// Places the vertices of a part that moves by poses. Parallel inside Workers::run().
  void place(std::uint32_t part);
  /// Takes the step back.
  void undo();

  const Motion& vertices() const { return motion_; }
  Motion& vertices() { return motion_; }
  std::uint32_t part_count() const { return static_cast<std::uint32_t>(parts_.size()); }
  /// The part that a vertex is in; in either numbers, since new ones stay within the part.
  std::uint32_t part_of(std::uint32_t vertex) const;
  /// The motion of the part's vertices; of one that waits for place(), that of the step before.
  const RangeMotion& range(std::uint32_t part) const { return parts_[part].range; }
  /// Union over the part's vertices, known without placing them (an upper bound then).
  MotionState state(std::uint32_t part) const;
  /// Does the part move by poses, with its vertices not at this step's?
  bool unplaced(std::uint32_t part) const { return parts_[part].posed && !parts_[part].placed; }

  /// What an unplaced part stays within, at both ends of the step: a ball about a moving centre.
  struct Ball {
    VertexMotion centre;
    double radius;
  };
  Ball ball(std::uint32_t part) const;

  std::uint32_t vertex_count(std::uint32_t part) const { return parts_[part].end - parts_[part].first; }
  /// Where vertex i of a part is at both ends of the step, placed or not.
  VertexMotion vertex(std::uint32_t part, std::uint32_t i) const;
  /// The same of all vertices of a part of MovingPoints::kMost or fewer, side by side.
  void points(std::uint32_t part, MovingPoints& points) const;

  /// Vertices that are not where they were; of unplaced parts all.
  std::uint64_t moved_vertices() const;
  /// Where everything is at the step's end, (n, 3), in the numbers first given.
  std::vector<double> positions() const;
  std::size_t memory_bytes() const;

 private:
  struct Part {
    std::uint32_t first = 0;  // of the vertices
    std::uint32_t end = 0;
    BodyKind kind = BodyKind::kDeformable;
    RangeMotion range;
    // Of rigid parts.
    std::vector<double> rest;  // (end - first, 3), in the order of the vertices here
    RestPoints points;         // of a small one
    std::array<double, 3> centre{};
    double radius = 0;
    Pose pose;
    Pose last_pose;
    bool posed = false;   // where it is, is where `pose` puts its rest shape
    bool placed = true;   // its vertices are there, too
    bool follows = true;  // they were at the end of the step before this one
    bool moved = false;   // in the step before this one
  };

  void find_parts(const Scene& scene);
  void make_rigid(Part& part);
  void settle(Part& part);  // a posed part's vertices go where they are, and it is posed no more
  void move_part(Part& part, const Positions& positions, std::uint32_t first_row);
  Status check_whole(const Scene& scene, const Positions& positions) const;
  Status check_parts(const Scene& scene, const Frame& frame);
  std::uint32_t new_vertex(std::uint32_t given) const {
    return numbering_ == nullptr ? given : numbering_->new_vertices()[given];
  }

  Motion motion_;
  std::vector<Part> parts_;
  const Renumbering* numbering_ = nullptr;
  std::vector<std::uint8_t> named_;  // by vertex: a frame has named it; all zero between checks
};

}  // namespace warmfront

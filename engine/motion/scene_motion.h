// SPDX-License-Identifier: Apache-2.0
// A scene's motion, part by part: what a frame says, checked and carried out as a transaction (Step). Written
// between steps by one thread, read by all during a step.
#pragma once

#include <algorithm>
#include <cstdint>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "engine/frame.h"
#include "engine/motion/motion.h"
#include "engine/motion/moving_points.h"
#include "engine/motion/reference_shape.h"
#include "engine/result.h"
#include "engine/scene.h"
#include "engine/scene/part_id.h"
#include "engine/scene/renumbering.h"
#include "engine/stop.h"
#include "engine/workers.h"

namespace warmfront {

class Arcs;

class SceneMotion {
 public:
  /// Stationary, in the numbers first given; begin() needs renumber() first. Throws Stopped when told to
  /// stop, as all that takes a StopSignal.
  SceneMotion(const Scene& scene, std::span<const double> positions, StopSignal stop = {});

  /// Takes new numbers for vertices from `first` on. The numbering outlives this.
  void renumber(const Renumbering& numbering, std::uint32_t first = 0, StopSignal stop = {});
  /// Appends the scene's bodies beyond those known, stationary; truncate() takes them back, also after an
  /// exception here or in renumber().
  void append(const Scene& scene, std::span<const double> positions, StopSignal stop = {});
  void truncate(std::uint32_t part_count, std::uint32_t vertex_count) noexcept;

  /// A part after some were replaced: what is at rest at these positions, in new numbers; or what was there,
  /// whose numbers begin at `first`.
  struct PartAfter {
    bool is_new = false;
    BodyKind kind = BodyKind::kDeformable;   // of a new part
    std::span<const double> positions = {};  // of a new part, (end - first, 3)
    std::uint32_t first = 0;
    std::uint32_t end = 0;
  };
  class Replacement;
  /// The motion of these parts one after the other, as long as this is not used otherwise; nothing has
  /// changed before take(). After settle() of what changes its kind.
  Replacement replaced(std::span<const PartAfter> parts, StopSignal stop);
  void take(Replacement replacement) noexcept;

  /// The shape of a part as it is now.
  std::shared_ptr<const ReferenceShape> shape_of(PartId part, StopSignal stop = {});
  /// What the vertices of a part reach, where they are; after settle() of the part.
  double measured_reach(PartId part, StopSignal stop = {}) const;
  /// A part is of another kind from now on; `shape` is its shape_of() where it becomes rigid, which it may
  /// have been before, else null, and `reach` is its measured_reach(). After settle() of the part.
  void change_kind(PartId part, BodyKind kind, std::shared_ptr<const ReferenceShape> shape,
                   double reach) noexcept;
  /// Brings the vertices of a part at a pose to where this puts them. Changes no placement.
  void settle(PartId part, StopSignal stop = {});

  /// Counts as stepped where this is, instead of another scene's motion.
  void follow_on(const SceneMotion& before) noexcept { steps_ = before.steps_; }

  /// Puts parts at checked poses, stationary. kFailedPrecondition after the first step.
  Status set_poses(std::span<const BodyPose> poses);

  /// kInvalidArgument, naming the field and the first offender, for a frame that does not fit the scene:
  /// wrong lengths, coordinates that are not finite, poses that are not rigid or not of a rigid body, indices
  /// out of range or named twice, static or removed bodies that move. Changes nothing, whatever happens.
  /// `workers`, if any, share many coordinates out.
  Status check(const Scene& scene, const Frame& frame, StopSignal stop = {},
               PoseCheck poses = PoseCheck::kRigid, Workers* workers = nullptr);

  /// A motion that was begun. It is taken by commit() or kept as a trial by keep(); a Step that ends without
  /// either rolls it back: every placement and position is then, bit for bit, what it was before begin(), or
  /// before the first of several trials.
  class Step {
   public:
    explicit Step(SceneMotion& motion) : motion_(motion) {}
    ~Step() {
      if (begun_ && !done_) motion_.roll_back();
    }
    Step(const Step&) = delete;
    Step& operator=(const Step&) = delete;

    /// Begins the step that a checked frame describes. Parts that move by poses only know these yet: see
    /// place(). Parallel inside Workers::run().
    void begin(const Frame& frame, StopSignal stop = {}) {
      begun_ = true;
      motion_.begin(frame, stop);
    }
    /// Begins the motion of the last trial, which there was, once more.
    void begin_again() {
      begun_ = true;
      motion_.begin_again();
    }
    void commit() noexcept {
      done_ = true;
      motion_.trial_ = false;
      ++motion_.steps_;
    }
    /// The next motion begins where this one did.
    void keep() noexcept {
      done_ = true;
      motion_.trial_ = true;
    }

   private:
    SceneMotion& motion_;
    bool begun_ = false;
    bool done_ = false;
  };

  /// Was the last motion a trial, so that everything stands where that began?
  bool trial() const { return trial_; }
  /// Where the motion that has begun begins.
  From from() const { return from_; }
  /// Takes the trial up to `fraction`, as Collider::commit() says. `arcs` are those of the trial.
  void commit_trial(double fraction, bool single, const Arcs& arcs) noexcept;

  /// Places the vertices of a part that moves by poses. Parallel inside Workers::run().
  void place(PartId part, StopSignal stop = {});

  const Motion& vertices() const { return motion_; }

  std::uint32_t part_count() const { return static_cast<std::uint32_t>(parts_.size()); }
  PartId end_part() const { return PartId{part_count()}; }  ///< after the last
  /// The part that a vertex is in; in either numbers, since new ones stay within the part.
  PartId part_of(std::uint32_t vertex) const;
  /// The motion of the part's vertices; of one that waits for place(), that of the step before.
  const RangeMotion& range(PartId part) const { return parts_[number_of(part)].range; }
  /// Union over the part's vertices, known without placing them (an upper bound then).
  MotionState state(PartId part) const;
  /// Does the part move by poses, with its vertices not at this step's?
  bool unplaced(PartId part) const { return !parts_[number_of(part)].placed; }

  /// What an unplaced part stays within, at both ends of the step: a ball about a moving centre.
  struct Ball {
    VertexMotion centre;
    double radius;
  };
  Ball ball(PartId part) const;

  /// The poses of a part at both ends of the step; the identity of one that does not move by poses.
  struct Poses {
    Pose start;
    Pose end;
  };
  Poses poses(PartId part) const;
  /// No local coordinate of the part is larger in magnitude at either end of the step, and none was where it
  /// begins if that is part of the way along an arc, which may lead half a chord beyond both of its ends.
  double reach(PartId part) const {
    const Part& of = parts_[number_of(part)];
    return std::max(of.reach_at_start, of.range.reach) * (of.rigid() ? 4 : 1);
  }
  /// Does the part move from one pose to another?
  bool turns(PartId part) const { return turns(parts_[number_of(part)]); }

  std::uint32_t first_vertex(PartId part) const { return parts_[number_of(part)].first; }
  std::uint32_t vertex_count(PartId part) const {
    return parts_[number_of(part)].end - parts_[number_of(part)].first;
  }
  /// Where vertex i of a part is at both ends of the step, placed or not.
  VertexMotion vertex(PartId part, std::uint32_t i) const;
  /// The same of all vertices of a part of MovingPoints::kMost or fewer, side by side.
  void points(PartId part, MovingPoints& points) const;

  /// Vertices that are not where they were; of unplaced parts all.
  std::uint64_t moved_vertices() const;
  /// Where everything is, (n, 3), in the numbers first given: at the end of a step, at the beginning of a
  /// trial.
  std::vector<double> positions() const;
  /// At which pose each rigid part is, in order, at the same time.
  std::vector<BodyPose> poses() const;
  std::size_t memory_bytes() const;

 private:
  struct Part {
    std::uint32_t first = 0;  // of the vertices
    std::uint32_t end = 0;
    BodyKind kind = BodyKind::kDeformable;

    bool placed = true;          // the vertices are at both ends of this step
    bool follows = true;         // they were at both ends of the motion before this one
    bool turned = false;         // the pose changed in the motion before this one
    bool shortened = false;      // that was committed in part
    bool written = false;        // in this step positions of vertices may be other than before it
    std::uint64_t begun_in = 0;  // the step that last began for the part; in others nothing is rolled back
    double reach_at_start = 0;   // RangeMotion::reach at t = 0
    // The vertices are the truth of a part that is AtPositions, and hold a copy of one that is AtPose.
    RangeMotion range;

    // The transaction: `start` is what counts until a step is committed, and what a roll back goes back to.
    // Only rigid parts are ever AtPose: of others neither is looked at in a step.
    Placement start;  // at t = 0
    Placement now;    // at t = 1

    bool rigid() const { return kind == BodyKind::kRigid; }
    // A half-space: only its poses are known here, and positions of all vertices do not tell of it.
    bool empty() const { return first == end; }
  };

  void begin(const Frame& frame, StopSignal stop);
  void begin_again();
  void begin_part(Part& part);
  void roll_back() noexcept;

  static Part stationary_part(const Motion& motion, std::uint32_t first, std::uint32_t end, BodyKind kind,
                              StopSignal stop);
  void find_parts(const Scene& scene, StopSignal stop);
  // The part is at the identity pose of its shape as it is now.
  void make_rigid(Part& part, StopSignal stop);
  void settle(Part& part, StopSignal stop);
  void move_part(Part& part, const Positions& positions, std::uint32_t first_row, StopSignal stop);
  double reach_at(const Part& part, const ReferenceShape& shape, const Pose& pose) const;
  void take_magnitude();
  static bool turns(const Part& part);
  static Pose pose_at_start(const Part& part);
  // Where the next motion begins.
  Pose pose_at_base(const Part& part) const;
  Status check_whole(const Scene& scene, const Positions& positions, StopSignal stop, Workers* workers) const;
  /// Does the pose put each vertex of the part, or the half-space's point, where a number is?
  bool is_finite_at(const Pose& pose, const Part& part, const Body& body, StopSignal stop) const;
  Status check_parts(const Scene& scene, const Frame& frame, StopSignal stop, PoseCheck poses,
                     Workers* workers);
  void clear_marks(const Frame& frame) noexcept;
  // An index into motion_, which is in given numbers until renumber().
  std::uint32_t new_vertex(GivenVertex vertex) const {
    return numbering_ == nullptr ? number_of(vertex) : number_of(numbering_->renumbered(vertex));
  }

  Motion motion_;
  std::vector<Part> parts_;
  const Renumbering* numbering_ = nullptr;
  std::vector<std::uint8_t> named_;  // by vertex: a frame has named it; all zero between checks
  std::vector<std::uint8_t> given_;  // by part: how the frame gives it
  double magnitude_before_ = 0;      // the step that has begun
  std::uint64_t steps_ = 0;          // committed
  std::uint64_t begun_ = 0;          // whether or not they were committed
  bool trial_ = false;               // the last motion was only asked about
  From from_ = From::kEnd;           // where the motion that was begun last begins
};

class SceneMotion::Replacement {
 private:
  friend class SceneMotion;
  struct NewVertices {
    Motion motion;
    std::uint32_t first;
  };
  std::vector<Run> runs;
  std::vector<NewVertices> vertices;
  std::vector<Part> parts;
  std::vector<std::uint8_t> named;
  std::vector<std::uint8_t> given;
};

}  // namespace warmfront

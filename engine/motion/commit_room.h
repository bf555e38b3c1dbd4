// SPDX-License-Identifier: Apache-2.0
// How far apart features must stay along a motion, so that a commit of part of it takes none through another
// by its roundings. Written before a question by one thread, read by all during it.
#pragma once

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

#include "engine/motion/motion.h"
#include "engine/motion/scene_motion.h"
#include "engine/options.h"
#include "engine/scene/collision_model.h"
#include "engine/stop.h"

namespace warmfront {

/// What rounds the vertices of a part that goes from pose to pose.
struct PosedRoom {
  double share = 0;  ///< 0: it does not move from pose to pose
  double translation = 0;
  bool turns = false;  ///< or may, where a commit rounds what does not change

  /// Of a vertex of which no coordinate, at either end, is larger.
  double of(double size) const { return share * 3 * translation + share * 2 * size; }
};

/// A commit of part of the way puts a vertex beside its path by less than 2^-49 (float32: 2^-23) of m, its
/// largest coordinate at either end, and leaves one that rests where it is (part_way.h). So two features that
/// are 2^-48 (2^-22) m apart, m being the largest of those of their vertices that move, are apart after it,
/// and so are they on every line from there to where the commit leaves them. Beside that is what underflows.
/// The room is 2^-44 (2^-22) m.
///
/// All vertices of a part that goes from pose to pose move, also where both ends are the same, and m is
/// 2 m + 3 t there, t being the largest coordinate of the translations of both poses: the rounding of a row
/// of its matrix counts for the reference shape's distance from its origin at most, which is the distance of
/// a vertex from the translation at the end, whose matrix is a rotation, and so at most 2 (m + t). In double,
/// where a row's roundings are of the larger of both ends' numbers, and placing rounds as much, it is 2^-46
/// of that, and the room 2^-42; along a screw 2^-40: sums of a few terms that are ten times as large, of
/// which two have shares that are within 2^-49 (screw.h).
///
/// No pair has less than kOfSize of its size and its separation: tests in double tell no less apart.
///
/// A half-space that goes from pose to pose turns by its matrix's rounding, which counts for the distance
/// from its point to the vertex: at most twice the largest coordinates of both together.
///
/// Which pairs stop how far from each other by that: narrow_phase/with_room.h.
class CommitRoom {
 public:
  static constexpr double kAway = 4;  ///< times the room, beyond the separation: where pairs stop
  static constexpr double kNear = 2;  ///< where those do that start nearer: they are apart after a commit
  static constexpr double kOfSize = 0x1p-44;

  /// For commits that round so of the motion that was begun. Throws Stopped when told to stop; none is asked
  /// for then.
  void take(Rounding rounding, const SceneMotion& motion, const CollisionModel& model,
            std::span<const std::uint32_t> body_of_vertex, StopSignal stop);
  void forget() noexcept { share_ = 0; }

  /// Is any asked for?
  bool any() const { return share_ > 0; }
  /// What two features with these vertices, in new numbers, must be apart by for what a commit rounds: 0
  /// where all of them rest and none is of a part that goes from pose to pose.
  double of(std::span<const std::uint32_t> vertices, std::span<const VertexMotion> motions) const;
  /// Beside that, for a pair of this size and separation.
  static double least_of(double size, double separation) { return kOfSize * std::max(size, separation); }
  /// Is each of them rounded by itself, so that each coordinate stays between its ends, but for 2^-50 of the
  /// largest: is none of a part that goes from pose to pose, and do both ends have the kind of numbers that a
  /// commit makes?
  bool by_themselves(std::span<const std::uint32_t> vertices, std::span<const VertexMotion> motions) const;
  /// Does each coordinate of each of them, wherever a commit leaves it, differ from its start only in the
  /// sense in which its end does? X + f (Y - X) is not beyond X where each operation rounds monotonely; and
  /// nor is what goes by poses that only translate, where the same sum is added to that.
  bool leave_straight(std::span<const std::uint32_t> vertices, std::span<const VertexMotion> motions) const;
  bool goes_by_poses(std::uint32_t body) const { return !posed_.empty() && posed_[body].share > 0; }
  /// The same of a vertex and a half-space, a body, of whose point no coordinate is larger than `farthest`.
  double of(std::uint32_t vertex, const VertexMotion& motion, std::uint32_t body, double farthest) const;
  /// At least what any pair has, with a separation, and with thickness, of at most this much.
  double most(double separation) const {
    return any() ? std::max(most_, least_of(farthest_, separation)) : 0;
  }

  std::size_t memory_bytes() const { return posed_.capacity() * sizeof posed_[0]; }

 private:
  double of(std::uint32_t vertex, const VertexMotion& motion) const;

  double share_ = 0;
  bool single_ = false;
  double least_ = 0;              // what underflows
  double most_ = 0;               // at least of() of any
  double farthest_ = 0;           // at least the size of any pair
  std::vector<PosedRoom> posed_;  // by part; empty where none is
  std::span<const std::uint32_t> body_of_vertex_;
};

/// What a commit that rounds so may leave any vertex of a part beside its way by, at least, in the scene's
/// unit: in the motion that was begun.
double most_commit_room(Rounding rounding, const SceneMotion& motion, const CollisionModel& model,
                        PartId part);

}  // namespace warmfront

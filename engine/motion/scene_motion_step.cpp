// SPDX-License-Identifier: Apache-2.0
// The transaction of a step: begin, commit a part of a trial, roll back.
#include <algorithm>
#include <optional>

#include "engine/motion/arcs.h"
#include "engine/motion/position_rows.h"
#include "engine/motion/scene_motion.h"
#include "engine/parallel/stoppable_loops.h"
#include "engine/part_way.h"
#include "engine/screw.h"

namespace warmfront {

void SceneMotion::move_part(Part& part, const Positions& positions, std::uint32_t first_row,
                            StopSignal stop) {
  settle(part, stop);
  part.written = true;
  std::visit(
      [&](auto values) {
        motion_.move_all(part.first, part.end, from_, values, numbering_->given_vertices(), first_row,
                         part.range, stop);
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
  for (Part& part : parts_) {
    paced.check();
    part.written = false;
    part.begun_in = begun_;
    begin_part(part);
  }
  const auto move = [&](std::size_t p) {
    Part& part = parts_[p];
    // Static and removed bodies were checked to stay, or are of no interest; half-spaces have no positions.
    const bool fixed = part.kind == BodyKind::kStatic || part.kind == BodyKind::kRemoved || part.empty();
    if (given_[p] == kByPositions && frame.positions && !fixed) {
      move_part(part, *frame.positions, 0, stop);
    } else if (given_[p] != kByPositions || fixed) {
      if (part.placed) motion_.rest(part.first, part.end, from_, part.range, stop);
      part.written = true;
    }
  };
  constexpr std::size_t kPartsAtOnce = 16;  // of many they are small
  for_each_index(0, parts_.size(), stop, move, parts_.size() <= 4 * kPartsAtOnce ? 1 : kPartsAtOnce);
  for (const BodyPositions& body : frame.bodies)
    move_part(parts_[body.body], body.positions, parts_[body.body].first, stop);
  for (const BodyPose& pose : frame.poses) {
    paced.check();
    Part& part = parts_[pose.body];
    auto* at = std::get_if<AtPose>(&part.now);
    if (at == nullptr)
      at = &part.now.emplace<AtPose>(
          AtPose{shape_of(part_of_body(pose.body), stop), {}});  // its positions were given last
    at->pose = pose.pose;
    part.range.reach = reach_at(part, *at->shape, at->pose);
  }
  for (Part& part : parts_) {
    // What moves by a pose, or did so in the last step, is not where its vertices are.
    if (part.rigid() && std::holds_alternative<AtPose>(part.now) && (part.turned || turns(part)))
      part.placed = false;
  }
  for (std::size_t i = 0; i < frame.vertices.size(); ++i) {
    paced.check();
    const std::uint32_t v = frame.vertices[i];
    motion_.move_one(new_vertex(GivenVertex{v}), row(frame.vertex_positions, i),
                     parts_[number_of(part_of(v))].range);
  }
  if (steps_ % kMeasureSteps == 0) {
    for (Part& part : parts_) {
      if (part.range.loose) motion_.measure(part.first, part.end, part.range, stop);
    }
  }
  take_magnitude();
}

// Vertices keep the states that the trial gave them: what moves does so again, and what it found changed is
// looked at once more.
void SceneMotion::begin_again() {
  from_ = From::kStart;
  magnitude_before_ = motion_.magnitude();
  ++begun_;
  for (Part& part : parts_) {
    part.begun_in = begun_;
    part.written = true;
    part.turned = part.rigid() && turns(part);
    // Vertices that were not placed are at neither end of the motion before this one.
    part.follows = part.placed;
  }
}

void SceneMotion::place(PartId index, StopSignal stop) {
  Part& part = parts_[number_of(index)];
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

void SceneMotion::commit_trial(double fraction, bool single, const Arcs& arcs) noexcept {
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
      const bool along_screw =
          arcs.of_part(PartId{static_cast<std::uint32_t>(&part - parts_.data())}) != nullptr;
      const Pose start = pose_at_start(part);
      pose = along_screw ? screw_way(start, pose, fraction, single) : part_way(start, pose, fraction, single);
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

}  // namespace warmfront

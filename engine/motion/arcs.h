// SPDX-License-Identifier: Apache-2.0
// How far vertices leave their lines in a motion: those of bodies that move along the screw between two
// poses. Written before a step by one thread, read by all during it.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "engine/motion/scene_motion.h"
#include "engine/scene/held_bytes.h"
#include "engine/scene/part_id.h"
#include "engine/screw.h"
#include "engine/stop.h"

namespace warmfront {

struct Arc {
  Twist twist;
  /// No vertex of the part is farther from its line, at equal times. In scene units, rounded up; infinite
  /// beyond double's range.
  double most = 0;
};

/// The length of a vector, rounded up, on every machine to the same bits; infinite for what is not finite.
double length_above(const std::array<double, 3>& x);

/// No coordinate that is computed of the bend at a point so far from the twist's centre, or of where it puts
/// the point at any time, is farther off. Infinite beyond double's range.
double rounding_of_bend(const Twist& twist, double from_centre);

/// What bounds and planes know of vertices is their lines: so what leaves out pairs that stay farther apart
/// than some separation adds the arcs of both parts to it, as it adds what is thick.
class Arcs {
 public:
  /// Of the motion that was begun, in which these parts move along screws. Throws Stopped when told to stop.
  void take(std::span<const PartId> screws, std::span<const std::uint32_t> body_of_vertex,
            const SceneMotion& motion, StopSignal stop);

  /// Does anything leave its line?
  bool any() const { return any_; }
  /// Null for a part of which nothing does.
  const Twist* of_part(PartId part) const {
    return any_ && of_part_[number_of(part)].most > 0 ? &of_part_[number_of(part)].twist : nullptr;
  }
  const Twist* around(std::uint32_t vertex) const { return any_ ? of_part(part_around(vertex)) : nullptr; }
  /// The part that a vertex, in either numbers, is in. Where there are any.
  PartId part_around(std::uint32_t vertex) const { return part_of_body(body_of_vertex_[vertex]); }
  double most_of(PartId part) const { return any_ ? of_part_[number_of(part)].most : 0; }
  /// `separation` with as much room as the lines of two parts need to tell of their arcs.
  double widened(double separation, PartId part_a, PartId part_b) const {
    return any_ ? (separation + (of_part_[number_of(part_a)].most + of_part_[number_of(part_b)].most)) *
                      (1 + 0x1p-40)
                : separation;
  }

  std::size_t memory_bytes() const { return held_bytes(of_part_); }

 private:
  std::vector<Arc> of_part_;
  std::span<const std::uint32_t> body_of_vertex_;
  bool any_ = false;
};

}  // namespace warmfront

// SPDX-License-Identifier: Apache-2.0
// Which near parts are certainly separated by a plane: most bodies of a pile, whose bounds overlap though
// they do not touch. Used by one thread at a time, inside Workers::run().
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "engine/broad_phase/part_pair.h"
#include "engine/broad_phase/separating_direction.h"
#include "engine/motion/arcs.h"
#include "engine/motion/scene_motion.h"
#include "engine/options.h"
#include "engine/scene/thickness.h"
#include "engine/stop.h"

namespace warmfront {

/// Two parts, and the unit vector along which b stays beyond a throughout the step.
struct ApartPair {
  PartPair parts;
  std::array<double, 3> direction;
};

/// A pair of parts is excluded from a step only if that changes no answer: a direction keeps the lines of all
/// of one farther from those of all of the other than the tier's reporting distance, and the arcs of both. So
/// the pair needs no front, and a part that moves by poses and has no other pair need not even be placed.
///
/// Only for small parts, where visiting each vertex is cheaper than visiting the pairs of triangles; only in
/// the tiers that report nothing farther apart: certified and exact.
class ApartParts {
 public:
  /// Begins a step. Returns whether any part is examined; if none is, no pair is excluded.
  bool begin(const SceneMotion& motion, const ColliderOptions& options);
  /// Is the part examined?
  bool small(const SceneMotion& motion, PartId part) const {
    return motion.vertex_count(part) - 1U < MovingPoints::kMost;
  }
  /// The part's vertices in this step. Threads may call it concurrently for different parts.
  const MovingPoints& points(const SceneMotion& motion, PartId part);

  /// Removes the pairs that are proved apart in this step, by `room` (local length) more than the tier needs,
  /// from `near` (sorted). For stationary pairs the last step's result holds, unless `rebuild`. Throws
  /// Stopped when told to stop.
  void sift(const SceneMotion& motion, const ColliderOptions& options, const Thickness& thickness,
            const Arcs& arcs, double room, bool rebuild, StopSignal stop, std::vector<NearPair>& near);

  /// Clears pairs(): no pair is excluded in this step.
  void forget() { apart_.clear(); }

  /// The excluded pairs, sorted.
  std::span<const ApartPair> pairs() const { return apart_; }
  std::size_t memory_bytes() const;

 private:
  using Direction = std::array<double, 3>;

  /// A pair's index in `near`, and its direction: from the last step, then from this one.
  struct Candidate {
    std::size_t place;
    std::optional<Direction> direction;
    bool holds;  // the last step's direction still separates
  };
  struct PartPoints {
    MovingPoints points;
    std::uint64_t step = 0;  // the step of these points
  };

  void choose(const SceneMotion& motion, bool rebuild, StopSignal stop, std::span<const NearPair> near);
  void look(const SceneMotion& motion, const ColliderOptions& options, const Thickness& thickness,
            const Arcs& arcs, double room, StopSignal stop, std::span<const NearPair> near);

  std::vector<ApartPair> apart_;
  std::vector<Candidate> candidates_;
  std::vector<PartPoints> points_;    // by part
  std::vector<PartId> parts_;         // parts that occur in candidates
  std::uint64_t step_ = 0;
};

}  // namespace warmfront

// SPDX-License-Identifier: Apache-2.0
// Which of the parts that are near each other a plane keeps apart for certain: most bodies of a pile, whose
// bounds overlap though they do not touch. Used by one thread at a time, inside Workers::run().
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "engine/broad_phase/part_pair.h"
#include "engine/broad_phase/separating_direction.h"
#include "engine/motion/scene_motion.h"
#include "engine/options.h"
#include "engine/stop.h"

namespace warmfront {

/// Two parts, and the unit vector along which b stays beyond a throughout the step.
struct ApartPair {
  PartPair parts;
  std::array<double, 3> direction;
};

/// A pair of parts is left out of a step only where that changes no answer: a direction keeps all of one
/// farther from all of the other than the tier reports at. So the parts need no front together; and one that
/// moves by poses, and meets no others, need not even be placed.
///
/// Only of small parts, of which a look at each vertex is cheaper than a look at the pairs of triangles; only
/// in the tiers that promise to report nothing farther apart: certified and exact.
class ApartParts {
 public:
  /// Begins a step. Does it look at parts at all?
  bool begin(const SceneMotion& motion, const ColliderOptions& options);
  /// Is the part one of those that it looks at?
  bool small(const SceneMotion& motion, std::uint32_t part) const {
    return motion.vertex_count(part) - 1U < MovingPoints::kMost;
  }
  /// The part's vertices in this step. Threads may ask for different parts at a time.
  const MovingPoints& points(const SceneMotion& motion, std::uint32_t part);

  /// Takes the pairs out of `near` (sorted) that are shown to be apart in this step. Of pairs at rest what
  /// was found in the last step holds, unless `rebuild`. Throws Stopped when told to stop.
  void sift(const SceneMotion& motion, const ColliderOptions& options, bool rebuild, StopSignal stop,
            std::vector<NearPair>& near);

  /// Nothing is taken out in this step.
  void forget() { apart_.clear(); }

  /// The pairs taken out, sorted.
  std::span<const ApartPair> pairs() const { return apart_; }
  std::size_t memory_bytes() const;

 private:
  using Direction = std::array<double, 3>;

  /// A pair's place in `near`, and the direction that was found of it: in the last step, then in this.
  struct Candidate {
    std::size_t place;
    std::optional<Direction> direction;
    bool holds;  // still
  };
  struct PartPoints {
    MovingPoints points;
    std::uint64_t step = 0;  // that they are of
  };

  void choose(const SceneMotion& motion, bool rebuild, StopSignal stop, std::span<const NearPair> near);
  void look(const SceneMotion& motion, const ColliderOptions& options, StopSignal stop,
            std::span<const NearPair> near);

  std::vector<ApartPair> apart_;
  std::vector<Candidate> candidates_;
  std::vector<PartPoints> points_;    // by part
  std::vector<std::uint32_t> parts_;  // that candidates name
  std::uint64_t step_ = 0;
};

}  // namespace warmfront

// SPDX-License-Identifier: Apache-2.0
#include "engine/broad_phase/apart_parts.h"

#include <algorithm>

#include "engine/elementary/certified.h"
#include "engine/parallel/stoppable_loops.h"

namespace warmfront {
namespace {

/// Near pairs per part. With more, the bodies overlap in one place: nothing separates them, and the lists of
/// pairs would be long.
constexpr std::size_t kMostNear = 64;

// The distance along one direction beyond which nothing between two parts is reported, for any motion: the
// certified tier's promise in certified.h, and `room` more. Only for the tiers certified and exact; exact
// reports nothing beyond the separation, of which the share of the size covers the rounding.
WantedGap wanted_gap(const ColliderOptions& options, double separation, const LocalTransform& frame,
                     double room) {
  const bool exact = options.tier == Tier::kExact;
  if (exact && separation == 0) return {.least = room};
  return {.least = frame.to_local(separation) + room,
          .share_of_size = certified_reach(exact ? 0 : options.tolerance)};
}

}  // namespace

bool ApartParts::begin(const SceneMotion& motion, const ColliderOptions& options) {
  ++step_;
  const bool looks = options.separate_parts && reports_by_distance(options) && motion.part_count() > 1;
  if (looks)
    points_.resize(motion.part_count());
  else
    forget();
  return looks;
}

const MovingPoints& ApartParts::points(const SceneMotion& motion, PartId part) {
  PartPoints& of = points_[number_of(part)];
  if (of.step != step_) motion.points(part, of.points);
  of.step = step_;
  return of.points;
}

void ApartParts::sift(const SceneMotion& motion, const ColliderOptions& options, const Thickness& thickness,
                      const Arcs& arcs, double room, bool rebuild, StopSignal stop,
                      std::vector<NearPair>& near) {
  if (near.size() > kMostNear * motion.part_count()) {
    apart_.clear();
    return;
  }
  choose(motion, rebuild, stop, near);
  look(motion, options, thickness, arcs, room, stop, near);
  apart_.clear();
  auto candidate = candidates_.begin();
  std::size_t kept = 0;
  for (std::size_t i = 0; i < near.size(); ++i) {
    const bool chosen = candidate != candidates_.end() && candidate->place == i;
    if (chosen && candidate->direction) {
      apart_.push_back({near[i].parts, *candidate->direction});
    } else {
      near[kept++] = near[i];
    }
    if (chosen) ++candidate;
  }
  near.resize(kept);
}

// Pairs of small parts, except stationary ones that were not proved apart: their distance has not changed.
void ApartParts::choose(const SceneMotion& motion, bool rebuild, StopSignal stop,
                        std::span<const NearPair> near) {
  candidates_.clear();
  auto last = apart_.begin();
  PacedStop paced(stop);
  for (std::size_t i = 0; i < near.size(); ++i) {
    paced.check();
    const auto [a, b] = near[i].parts;
    if (a == b || !small(motion, a) || !small(motion, b)) continue;
    const bool rests = near[i].rests && !rebuild;
    while (last != apart_.end() && last->parts < near[i].parts) ++last;
    if (last != apart_.end() && last->parts == near[i].parts) {
      candidates_.push_back({i, last->direction, rests});
    } else if (!rests) {
      candidates_.push_back({i, std::nullopt, false});
    }
  }
}

void ApartParts::look(const SceneMotion& motion, const ColliderOptions& options, const Thickness& thickness,
                      const Arcs& arcs, double room, StopSignal stop, std::span<const NearPair> near) {
  parts_.clear();
  for (const Candidate& candidate : candidates_) {
    const PartPair& parts = near[candidate.place].parts;
    if (!candidate.holds) parts_.insert(parts_.end(), {parts.a, parts.b});
  }
  std::ranges::sort(parts_);
  parts_.erase(std::unique(parts_.begin(), parts_.end()), parts_.end());
  constexpr std::size_t kAtOnce = 16;
  const auto in_parallel = [&](std::size_t count, auto&& body) {
    for_each_index(0, count, stop, body, kAtOnce);
  };
  in_parallel(parts_.size(), [&](std::size_t i) { points(motion, parts_[i]); });
  const LocalTransform& frame = motion.vertices().frame();
  in_parallel(candidates_.size(), [&](std::size_t i) {
    Candidate& candidate = candidates_[i];
    if (candidate.holds) return;
    const PartPair& parts = near[candidate.place].parts;
    const double thick = thickness.between(options.min_separation, parts.a, parts.b);
    const double separation = arcs.widened(thick, parts.a, parts.b);
    const WantedGap wanted = wanted_gap(options, separation, frame, room);
    candidate.direction =
        separating_direction(points_[number_of(parts.a)].points, points_[number_of(parts.b)].points, frame,
                             wanted, candidate.direction);
  });
}

std::size_t ApartParts::memory_bytes() const {
  std::size_t bytes = apart_.capacity() * sizeof(ApartPair) + candidates_.capacity() * sizeof(Candidate) +
                      points_.capacity() * sizeof(PartPoints) + parts_.capacity() * sizeof(PartId);
  for (const PartPoints& of : points_) bytes += of.points.memory_bytes();
  return bytes;
}

}  // namespace warmfront

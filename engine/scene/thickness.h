// SPDX-License-Identifier: Apache-2.0
// How thick a scene's vertices are, and so how far apart its features must stay. Immutable once built; safe
// to share between threads.
#pragma once

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

#include "engine/options.h"
#include "engine/result.h"
#include "engine/scene.h"
#include "engine/scene/held_bytes.h"
#include "engine/scene/part_id.h"
#include "engine/scene/renumbering.h"
#include "engine/stop.h"

namespace warmfront {

/// By vertex, in new numbers, in the scene's unit. A face or an edge is as thick as the thickest of its
/// vertices.
class Thickness {
 public:
  Thickness() = default;  ///< nothing has any
  /// Of a scene in given numbers, of which `parts` are the ranges of vertices, in new numbers. O(n), or
  /// nothing where nothing has any. Throws Stopped when told to stop.
  Thickness(const Scene& given, std::span<const FeatureRange> parts, const Renumbering& numbering,
            StopSignal stop);

  bool any() const { return !of_vertex_.empty(); }
  double of(std::uint32_t vertex) const { return of_vertex_[vertex]; }
  /// Of a primitive with these vertices.
  double of(std::span<const std::uint32_t> vertices) const {
    double most = 0;
    for (const std::uint32_t v : vertices) most = std::max(most, of_vertex_[v]);
    return most;
  }
  /// The thickest vertex of a part; a half-space's own thickness.
  double of_part(PartId part) const { return of_part_[number_of(part)]; }
  /// The part that a vertex is in.
  PartId part_around(std::uint32_t vertex) const { return part_of_vertex_[vertex]; }
  /// At least separation_of() of any two features of two parts, by so much that the cascade's own rounding of
  /// a sum of their thickness is less.
  double between(double asked, PartId part_a, PartId part_b) const;
  /// The thickest of all.
  double most() const { return most_; }

  /// thickness_checksum() of what was built, for the self-check.
  std::uint64_t built_sum() const { return built_sum_; }
  void set_built_sum(std::uint64_t sum) { built_sum_ = sum; }
  std::span<const double> of_vertices() const { return of_vertex_; }
  std::span<const double> of_parts() const { return of_part_; }

  std::size_t memory_bytes() const { return held_bytes(of_vertex_, part_of_vertex_, of_part_); }

 private:
  std::vector<double> of_vertex_;
  std::vector<PartId> part_of_vertex_;
  std::vector<double> of_part_;
  double most_ = 0;
  std::uint64_t built_sum_ = 0;
};

/// kInvalidArgument where a scene of which no vertex is thicker does not go with the options: in tier fast,
/// which decides touching, and for a separation that would leave double's range.
Status check_thickness(double most, const ColliderOptions& options);

/// The separation of a pair of features with these thicknesses, in a question with this separation for all.
/// It grows with each of the three, roundings included: so what holds for the thickest of several holds for
/// all.
inline double separation_of(double asked, double thickness_a, double thickness_b) {
  return asked + (thickness_a + thickness_b);
}

/// What is left, at least, of a distance of two features when the thickness of both is taken from it; 0 where
/// that is more. Rounded down by more than the three operations are rounded.
inline double beyond_thickness(double distance, double thickness_a, double thickness_b) {
  const double thickness = thickness_a + thickness_b;
  if (thickness == 0) return distance;
  return std::max(0.0, (distance - thickness * (1 + 0x1p-51)) * (1 - 0x1p-51));
}

inline double Thickness::between(double asked, PartId part_a, PartId part_b) const {
  if (!any()) return asked;
  return separation_of(asked, of_part_[number_of(part_a)], of_part_[number_of(part_b)]) * (1 + 0x1p-40);
}

}  // namespace warmfront

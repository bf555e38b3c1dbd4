// SPDX-License-Identifier: Apache-2.0
// Which pairs PairFilters leaves out, as far as vertices tell. Immutable once built; safe to share between
// threads.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "engine/scene.h"
#include "engine/scene/excluded_vertices.h"
#include "engine/scene/held_bytes.h"
#include "engine/scene/renumbering.h"
#include "engine/stop.h"

namespace warmfront {

/// In new numbers. What is decided here goes by pairs of vertices, so that all pairs of two faces are decided
/// at once: which pairs of their six vertices are excluded says it of their features. A pair of vertices
/// that are near enough at rest leaves out what they belong to; of the others rest_distance() is to be
/// compared with the features' own distance at rest.
class PairFilter {
 public:
  PairFilter() = default;  ///< leaves nothing out
  /// As ExcludedVertices() says.
  PairFilter(const PairFilters& filters, std::span<const FeatureRange> parts, const Renumbering& numbering,
             const Scene& renumbered, StopSignal stop);

  bool any() const { return any_; }

  /// The pairs of features of two faces without a common vertex that are left out: bits as
  /// Ownership::Candidates. Where all are, so are the pairs of an edge of one with the other: whichever rule
  /// leaves out each pair of the edge's vertices with a face leaves out the edge's.
  std::uint32_t left_out(const Face& f, const Face& g) const;
  static constexpr std::uint32_t kAll = 0x7fff;

  /// The same of one pair, of features with these vertices.
  bool leaves_out(std::span<const std::uint32_t> a, std::span<const std::uint32_t> b) const;

  /// 0: no pair is left out for being near at rest.
  double rest_distance() const { return rest_distance_; }
  const std::array<double, 4>& at_rest(std::uint32_t v) const { return at_rest_[v]; }
  /// Of each vertex x, y, z and padding, as in VertexMotion; empty where rest_distance() is 0.
  std::span<const std::array<double, 4>> rest_shape() const { return at_rest_; }

  const ExcludedVertices& excluded_vertices() const { return excluded_; }
  /// Of each vertex; empty without patches.
  std::span<const std::uint32_t> patches() const { return patches_; }

  /// filter_checksum() of what was built, for the self-check.
  std::uint64_t built_sum() const { return built_sum_; }
  void set_built_sum(std::uint64_t sum) { built_sum_ = sum; }

  std::size_t memory_bytes() const { return excluded_.memory_bytes() + held_bytes(patches_, at_rest_); }

 private:
  bool excludes(std::uint32_t v, std::uint32_t w) const {
    return (!excluded_.empty() && excluded_.contains(v, w)) || (rest_distance_ > 0 && is_near_at_rest(v, w));
  }
  bool is_near_at_rest(std::uint32_t v, std::uint32_t w) const;

  bool any_ = false;
  std::uint64_t built_sum_ = 0;
  ExcludedVertices excluded_;
  std::vector<std::uint32_t> patches_;
  std::vector<std::array<double, 4>> at_rest_;
  double rest_distance_ = 0;
  double squared_from_below_ = 0;  // of rest_distance_; < 0 where that says nothing
};

}  // namespace warmfront

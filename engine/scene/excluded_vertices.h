// SPDX-License-Identifier: Apache-2.0
// The vertices that each vertex is excluded with: those within some edges of it, and those listed with it.
// Immutable once built; safe to share between threads.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "engine/scene.h"
#include "engine/scene/held_bytes.h"
#include "engine/scene/renumbering.h"
#include "engine/scene/scene_edges.h"
#include "engine/stop.h"

namespace warmfront {

class ExcludedVertices {
 public:
  ExcludedVertices() = default;
  /// In the numbers of `renumbered`. Edges are followed in these parts alone: those that are tested against
  /// themselves. O(n + ways): see check_rings(). Throws Stopped when told to stop.
  ExcludedVertices(const PairFilters& filters, std::span<const FeatureRange> parts,
                   const Renumbering& numbering, const Scene& renumbered, StopSignal stop);

  bool empty() const { return items_.empty(); }
  /// Where each vertex's begin and end in items().
  std::span<const std::size_t> begin() const { return begin_; }
  std::span<const std::uint32_t> items() const { return items_; }
  /// Ascending, without v.
  std::span<const std::uint32_t> of(std::uint32_t v) const {
    return {items_.data() + begin_[v], items_.data() + begin_[v + 1]};
  }
  /// For two different vertices.
  bool contains(std::uint32_t v, std::uint32_t w) const {
    const std::span<const std::uint32_t> row = of(v);
    if (row.empty() || w < row.front() || w > row.back()) return false;
    return std::ranges::binary_search(row, w);
  }
  /// Bit 3 i + j is set where vertices i of one face and j of the other, which differ, are such a pair.
  std::uint32_t pairs_of(const Face& f, const Face& g) const;

  std::size_t memory_bytes() const { return held_bytes(begin_, items_); }

 private:
  std::vector<std::size_t> begin_;  // by vertex; empty without any
  std::vector<std::uint32_t> items_;
};

/// Fails with kResourceExhausted, naming the vertex with most edges, where hub vertices of bodies that are
/// tested against themselves have too many others within filters().within_edges edges: more ways of so many
/// edges than kMostWays, and than kMostWaysAVertex for each vertex (a regular mesh has 216 of three edges).
/// O(n). Writes that vertex to `hub` unless null. Throws Stopped when told to stop.
Status check_rings(const Scene& scene, StopSignal stop = {}, std::uint32_t* hub = nullptr);
inline constexpr std::uint64_t kMostWays = 16'000'000;
inline constexpr std::uint64_t kMostWaysAVertex = 2048;

}  // namespace warmfront

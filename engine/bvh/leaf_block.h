// SPDX-License-Identifier: Apache-2.0
// The primitives of a leaf side by side, so that one is tested against all of another leaf at once. Written
// between steps, read by all threads during a step.
#pragma once

#include <array>
#include <cstdint>

#include "engine/bounds/kdop.h"
#include "engine/scene/scene.h"

namespace warmfront {

/// Bounds and vertices of up to eight primitives, lane by lane: slot i of every array is primitive i.
template <class Bounds>
struct LeafBlock {
  static constexpr std::uint32_t kSlots = 8;
  /// As Slabs::lane; what empty slots hold is never looked at.
  alignas(32) std::array<std::array<float, kSlots>, 4 * Bounds::kAxes> lane;
  /// A primitive's vertices; an isolated vertex stands three times.
  alignas(32) std::array<std::array<std::uint32_t, kSlots>, 3> vertex;
  std::uint32_t count;

  void set(std::uint32_t slot, const Bounds& bounds) {
    for (std::size_t k = 0; k < lane.size(); ++k) lane[k][slot] = bounds.lane[k];
  }
};

/// Bit 8 j + i stands for primitive i of leaf a and primitive j of leaf b.
struct LeafOverlaps {
  std::uint64_t to_test;  ///< their moving bounds overlap and they share no vertex
  /// How far apart at t = 1 the nearest two are that share no vertex, as separation() measures it, or less;
  /// not positive when some overlap then.
  float gap;
};

/// All primitives of leaf `a` against all of leaf `b`, whose bounds as a whole are `node_b`. With
/// `same` (a and b are one leaf), each pair once, i < j.
LeafOverlaps leaf_overlaps(const LeafBlock<Aabb>& a, const LeafBlock<Aabb>& b, const Aabb& node_b, bool same);
LeafOverlaps leaf_overlaps(const LeafBlock<KDop18>& a, const LeafBlock<KDop18>& b, const KDop18& node_b,
                           bool same);

/// The same for the part of the step up to the time `until` < 1.
LeafOverlaps leaf_overlaps(const LeafBlock<Aabb>& a, const LeafBlock<Aabb>& b, const Aabb& node_b, bool same,
                           float until);
LeafOverlaps leaf_overlaps(const LeafBlock<KDop18>& a, const LeafBlock<KDop18>& b, const KDop18& node_b,
                           bool same, float until);

}  // namespace warmfront

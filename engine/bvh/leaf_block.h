// SPDX-License-Identifier: Apache-2.0
// What is below a leaf side by side, so that one is tested against eight of another leaf at once: primitives
// in blocks, and blocks in leaves that hold more than one. Written between steps, read by all threads during
// a step.
#pragma once

#include <array>
#include <cstdint>

#include "engine/bounds/kdop.h"
#include "engine/scene/scene.h"

namespace warmfront {

/// Up to eight bounds, lane by lane: slot i of every lane is of the i-th.
template <class Bounds>
struct EightBounds {
  static constexpr std::uint32_t kSlots = 8;
  /// As Slabs::lane; what empty slots hold is never looked at.
  alignas(32) std::array<std::array<float, kSlots>, 4 * Bounds::kAxes> lane;
  std::uint32_t count;
  std::uint32_t first;  ///< where the first stands: among the blocks, or in the hierarchy's order
};

/// Bounds and vertices of up to eight primitives.
template <class Bounds>
struct LeafBlock : EightBounds<Bounds> {
  /// A primitive's vertices; an isolated vertex stands three times.
  alignas(32) std::array<std::array<std::uint32_t, 8>, 3> vertex;
};

/// One bounds, alone or of eight.
struct LanesOfOne {
  const float* first;
  std::size_t stride;

  template <class Bounds>
  static LanesOfOne of(const Bounds& bounds) {
    return {bounds.lane.data(), 1};
  }
  template <class Bounds>
  static LanesOfOne of(const EightBounds<Bounds>& eight, std::uint32_t slot) {
    return {&eight.lane[0][slot], EightBounds<Bounds>::kSlots};
  }
  float operator()(int lane) const { return first[static_cast<std::size_t>(lane) * stride]; }
};

/// Bit 8 j + i stands for item i of a and item j of b.
struct EightOverlaps {
  std::uint64_t to_test;
  float gap;
  bool adjacent;  ///< some of two different items share a vertex
};

/// All primitives of block `a` against all of block `b`, whose bounds as a whole are `whole_b`. With `same`
/// (a and b are one block), each pair once, i < j. To be tested are those whose moving bounds overlap and
/// that share no vertex; `gap` is how far apart at t = 1 the nearest two are that share no vertex, as
/// separation() measures it, or less; not positive when some overlap then. Only the part of the step up to
/// the time `until` counts; 1 or more: all of it.
EightOverlaps primitive_overlaps(const LeafBlock<Aabb>& a, const LeafBlock<Aabb>& b, LanesOfOne whole_b,
                                 bool same, float until);
EightOverlaps primitive_overlaps(const LeafBlock<KDop18>& a, const LeafBlock<KDop18>& b, LanesOfOne whole_b,
                                 bool same, float until);

/// The same for the blocks of two leaves. With `same` each pair once, i <= j, and a block overlaps itself.
/// The gap is that of the nearest two that do not overlap; who shares vertices is not looked at.
EightOverlaps block_overlaps(const EightBounds<Aabb>& a, const EightBounds<Aabb>& b, LanesOfOne whole_b,
                             bool same, float until);
EightOverlaps block_overlaps(const EightBounds<KDop18>& a, const EightBounds<KDop18>& b, LanesOfOne whole_b,
                             bool same, float until);

}  // namespace warmfront

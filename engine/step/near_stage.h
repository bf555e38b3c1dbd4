// SPDX-License-Identifier: Apache-2.0
// The stage that finds which parts are near each other, less those that a plane separates. Used by one thread
// at a time, inside Workers::run().
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "engine/broad_phase/apart_parts.h"
#include "engine/broad_phase/near_parts.h"
#include "engine/state/part_trees.h"
#include "engine/step/pipeline.h"

namespace warmfront {

template <class Bounds>
class NearStage {
 public:
  /// Begins a step.
  void begin(const Core& core) { separates_ = apart_.begin(core.motion, core.options); }
  /// What looks for planes in this step; null if nothing does.
  ApartParts* apart() { return separates_ ? &apart_ : nullptr; }

  /// Nothing that is known of near parts holds: the next find() takes nothing from the last.
  void forget() noexcept { stale_ = true; }
  bool stale() const { return stale_; }

  /// Finds the pairs of parts that are near each other in this step. Where these are too many to keep,
  /// overflowed() is true, pairs() is empty, and next_block() returns them block by block. Pairs that a plane
  /// separates are left out. Returns the number of tests. Throws Stopped when told to stop; forget() must
  /// follow.
  std::uint64_t find(const Core& core, const PartTrees<Bounds>& trees, Kind kind, StopSignal stop);
  bool overflowed() const { return near_.overflowed(); }
  /// Takes the next block as pairs(). Returns false when there are no more. Adds its tests to `bv_tests`.
  bool next_block(const Core& core, const PartTrees<Bounds>& trees, std::uint64_t& bv_tests, StopSignal stop);

  /// Sorted; a part that is tested against itself is near itself.
  std::span<const NearPair> pairs() const { return pairs_; }
  /// How many in this step, in blocks or not.
  std::uint64_t count() const { return count_; }
  /// Those that are left out.
  std::span<const ApartPair> apart_pairs() const { return apart_.pairs(); }

  /// Frees the memory that a failed step allocated.
  void release() noexcept;
  std::size_t memory_bytes() const;

 private:
  void take(const Core& core, std::span<const NearPair> near);

  NearParts<Bounds> near_;
  ApartParts apart_;
  std::vector<NearPair> pairs_;
  std::uint64_t count_ = 0;
  bool separates_ = false;
  bool stale_ = true;
};

}  // namespace warmfront

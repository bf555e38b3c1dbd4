// SPDX-License-Identifier: Apache-2.0
// Which world each body of a scene is in. Immutable once built; safe to share between threads.
#pragma once

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

#include "engine/scene.h"
#include "engine/scene/held_bytes.h"
#include "engine/stop.h"

namespace warmfront {

/// The worlds of a scene in ascending order, which are called by their place in it. A pair of bodies is in
/// the world that either has: in that of the larger number, since two different worlds never meet and 0 is
/// none.
class Worlds {
 public:
  Worlds() = default;  ///< no body has one
  /// Of the bodies that are not removed. O(bodies log bodies). Throws Stopped when told to stop.
  explicit Worlds(const Scene& scene, StopSignal stop = {});

  bool any() const { return !numbers_.empty(); }
  /// Ascending, with 0 where a body is in none; empty where no body has one.
  std::span<const std::uint32_t> numbers() const { return numbers_; }
  /// How many places there are: 1 where no body has a world.
  std::size_t places() const { return any() ? numbers_.size() : 1; }
  /// The place of what is between two bodies that may meet, or within one.
  std::uint32_t place(std::uint32_t body_a, std::uint32_t body_b) const {
    return any() ? std::max(of_body_[body_a], of_body_[body_b]) : 0;
  }

  std::size_t memory_bytes() const { return held_bytes(numbers_, of_body_); }

 private:
  std::vector<std::uint32_t> numbers_;
  std::vector<std::uint32_t> of_body_;  // its place
};

}  // namespace warmfront

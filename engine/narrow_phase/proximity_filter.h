// SPDX-License-Identifier: Apache-2.0
// Whether the pairs of a block are within a distance of each other at an instant, as far as plain doubles
// prove it, several pairs at a time. Pure functions.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "engine/motion/motion.h"
#include "engine/narrow_phase/feature_block.h"
#include "engine/options.h"

namespace warmfront {

enum class Nearness : std::uint8_t {
  kUnproved,  ///< proximity_test() decides
  kNear,      ///< the distance is no more than the separation
  kApart,     ///< it is more
};

/// Stage before proximity_test(): of each pair, by its own separation (>= 0, not NaN), what is certain in
/// real arithmetic on the given doubles. `nearness` has room for all pairs. What is proved of a pair depends
/// on that pair only. With `excess` the separation is larger by so much of the pair's size, the largest
/// coordinate difference between vertices of the two primitives.
void proximity_filter(std::span<const FeaturePair> pairs, std::span<const VertexMotion> vertices, Instant at,
                      std::span<const double> separations, Nearness* nearness, double excess = 0);

/// The same of pairs of vertices at `places`, (x, y, z, padding), by one separation.
void proximity_filter(std::span<const FeaturePair> pairs, std::span<const std::array<double, 4>> places,
                      double separation, Nearness* nearness);

}  // namespace warmfront

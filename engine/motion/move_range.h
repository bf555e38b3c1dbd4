// SPDX-License-Identifier: Apache-2.0
// Moves many vertices to new positions, in lanes. Thread-safe for different ranges.
#pragma once

#include <cstdint>

#include "engine/motion/local_lanes.h"
#include "engine/motion/motion.h"
#include "engine/motion/range_grains.h"

namespace warmfront {

// Where vertices go, and what it takes to bring that into the local frame.
template <class Real>
struct Targets {
  const Real* positions;
  const GivenVertex* order;  ///< by vertex
  std::uint32_t first_row;
  LocalLanes to_local;
};

/// Moves vertices [begin, end) as Motion::move_all() says, and adds to `sum` what they came to.
void move_range(From from, const Targets<float>& targets, VertexMotion* vertices, MotionState* states,
                std::uint32_t begin, std::uint32_t end, Moved& sum);
void move_range(From from, const Targets<double>& targets, VertexMotion* vertices, MotionState* states,
                std::uint32_t begin, std::uint32_t end, Moved& sum);

}  // namespace warmfront

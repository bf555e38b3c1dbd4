// SPDX-License-Identifier: Apache-2.0
// Feature pairs whose vertices are never in one plane during the step do not meet. Pure function.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "engine/motion/motion.h"
#include "engine/narrow_phase/feature_block.h"

namespace warmfront {

/// Stage T1 over a block, several pairs at a time: writes to `survivors` (of at least pairs.size() elements)
/// the indices, ascending, of the pairs whose coplanarity cubic may vanish (widened by the pair's separation;
/// `separations` is empty where all are 0), and returns their number. If all coefficients certainly have one
/// sign, there is no contact. Same bound as Cubic, on unscaled coordinates: where they would overflow or
/// underflow the pair survives. Answers are the same on every instruction set.
std::size_t coplanarity_filter(std::span<const FeaturePair> pairs, std::span<const VertexMotion> vertices,
                               std::span<const double> separations, std::uint16_t* survivors);

}  // namespace warmfront
